#include "daemon/estimator/tube_motion.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

// Random walk, per root second: 1.5 mm is 0.3 mm in the 44 ms that a push of 1 mm takes at 22.5 mm/s.
constexpr double kSideways_mm = 1.5;
constexpr double kSidewaysAtTip_mm = 3.0;
constexpr double kTipReach_mm = 30;        // over which the tip's freedom fades
constexpr double kSidewaysLength_mm = 25;  // correlation along the tube
constexpr double kSwayShare = 0.15;        // of its variance that moves long stretches together
constexpr double kSwayLength_mm = 150;
constexpr double kSlidingSpeed_mm_s = 10;  // of the sliding that the estimated speed does not foresee
constexpr double kSpeed_mm_s = 25;         // how fast it is pushed or pulled, usually
constexpr double kSpeedMemory_s = 0.4;     // how long a hand keeps its speed
constexpr double kDriftMemory_s = 1;       // how long a stretch that moves to a side goes on
constexpr double kDriftAtFirst_mm_s = 3;   // 7 for a second would let a coil be wrong by as much
constexpr double kDriftSpacing_mm = 63;    // tube to a node
constexpr double kDriftLearnt_s = 0.5;     // over which it is learnt how fast it does so
constexpr double kUnseenShare = 0.1;       // what is not known of a velocity: much when nothing was measured
constexpr double kMaxDrift = 4;            // of its variance, beside the usual

}  // namespace

int TubeMotion::column_count_of_motion(double length_mm) {
  return 1 + std::clamp(1 + static_cast<int>(std::lround(length_mm / kDriftSpacing_mm)), 2, kMaxNodes);
}

TubeMotion::TubeMotion(const UniformCubicBSpline& spline, int column_count)
    : coefficient_count_(spline.coefficient_count()),
      drift_count_(column_count_of_motion(spline.length_mm()) - 1),
      speed_(3 * (column_count - 1)),
      drift_(speed_ - 3 * drift_count_),
      spacing_mm_(spline.spacing_mm()),
      sideways_(coefficient_count_, coefficient_count_),
      drifting_(Eigen::MatrixXd::Zero(coefficient_count_, drift_count_)),
      sliding_(Eigen::VectorXd::Zero(3 * column_count)),
      shifted_(Eigen::Matrix3Xd::Zero(3, coefficient_count_)),
      columns_(Eigen::MatrixXd::Zero(3 * column_count, 3 * coefficient_count_)),
      with_speed_(sliding_) {
  const auto freedom = [this](Eigen::Index coefficient) {
    const double s_mm = std::max(0.0, (static_cast<double>(coefficient) - 1) * spacing_mm_);
    return kSideways_mm + (kSidewaysAtTip_mm - kSideways_mm) * std::exp(-s_mm / kTipReach_mm);
  };
  for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
    for (Eigen::Index j = 0; j < coefficient_count_; ++j) {
      const double distance = static_cast<double>(i - j) * spacing_mm_ / kSidewaysLength_mm;
      const double far = static_cast<double>(i - j) * spacing_mm_ / kSwayLength_mm;
      sideways_(i, j) =
          freedom(i) * freedom(j) *
          ((1 - kSwayShare) * std::exp(-0.5 * distance * distance) + kSwayShare * std::exp(-0.5 * far * far));
    }
  }
  for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
    const auto [column, share] = nodes_of(i);
    drifting_(i, column - drift_ / 3) = 1 - share;
    drifting_(i, column - drift_ / 3 + 1) = share;
  }
}

void TubeMotion::begin(Eigen::Matrix3Xd& C, Eigen::MatrixXd& P) const {
  const Eigen::Index rows = 3 * (drift_count_ + 1);
  C.rightCols(drift_count_ + 1).setZero();
  P.bottomRows(rows).setZero();
  P.rightCols(rows).setZero();
  P.diagonal().segment(drift_, 3 * drift_count_).setConstant(kDriftAtFirst_mm_s * kDriftAtFirst_mm_s);
  P.diagonal().tail<3>() << kSpeed_mm_s * kSpeed_mm_s, 1, 1;
}

// The curve is the coefficients' sequence smoothed by the B-spline, and smoothing and shifting commute: so
// the sequence is shifted, by cubic interpolation.
TubeMotion::Shift TubeMotion::shift_of(Eigen::Index coefficient, double slid_mm) const {
  const double place = static_cast<double>(coefficient) - slid_mm / spacing_mm_;
  Shift shift;
  shift.first =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(place)) - 1, 0, coefficient_count_ - 4);
  // Beyond either end it goes on straight, as wide cubic extrapolation would swing.
  const double u = place - static_cast<double>(shift.first);
  if (u < 0) {
    shift.weights = {1 - u, u, 0, 0};
  } else if (u > 3) {
    shift.weights = {0, 0, 3 - u, u - 2};
  } else {
    shift.weights = {-(u - 1) * (u - 2) * (u - 3) / 6, u * (u - 2) * (u - 3) / 2, -u * (u - 1) * (u - 3) / 2,
                     u * (u - 1) * (u - 2) / 6};
  }
  return shift;
}

void TubeMotion::shift(double slid_mm, Eigen::Matrix3Xd& C) {
  for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
    const Shift shift = shift_of(i, slid_mm);
    shifted_.col(i) = C.middleCols<4>(shift.first) * Eigen::Vector4d(shift.weights.data());
  }
  C.leftCols(coefficient_count_) = shifted_;
}

TubeMotion::Between TubeMotion::nodes_of(Eigen::Index coefficient) const {
  const double place = static_cast<double>(coefficient) / static_cast<double>(coefficient_count_ - 1) *
                       static_cast<double>(drift_count_ - 1);
  const auto node = std::min(static_cast<Eigen::Index>(place), drift_count_ - 2);
  return {drift_ / 3 + node, place - static_cast<double>(node)};
}

void TubeMotion::drift(double way_s, const Eigen::Matrix3Xd& m, Eigen::Matrix3Xd& C) const {
  for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
    const auto [column, share] = nodes_of(i);
    C.col(i) += way_s * ((1 - share) * m.col(column) + share * m.col(column + 1));
  }
}

// By columns, which lie next to each other in memory.
void TubeMotion::move_columns(double slid_mm, double way_s, Eigen::MatrixXd& P) {
  for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
    const Shift shift = shift_of(i, slid_mm);
    const auto& [w0, w1, w2, w3] = shift.weights;
    const Eigen::Index from = 3 * shift.first;
    const auto [column, share] = nodes_of(i);
    columns_.middleCols<3>(3 * i) = w0 * P.middleCols<3>(from) + w1 * P.middleCols<3>(from + 3) +
                                    w2 * P.middleCols<3>(from + 6) + w3 * P.middleCols<3>(from + 9) +
                                    way_s * (1 - share) * P.middleCols<3>(3 * column) +
                                    way_s * share * P.middleCols<3>(3 * column + 3);
  }
  P.leftCols(3 * coefficient_count_) = columns_;
}

void TubeMotion::predict(double dt_s, const Freedom& freedom, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m,
                         Eigen::MatrixXd& P) {
  const double slid_mm = m(0, m.cols() - 1) * dt_s;
  const double way_s = kDriftMemory_s * (1 - std::exp(-dt_s / kDriftMemory_s));  // of a velocity that fades
  for (Eigen::Matrix3Xd* mean : {&C, &m}) {
    shift(slid_mm, *mean);
    drift(way_s, m, *mean);
  }
  move_columns(slid_mm, way_s, P);
  P.transposeInPlace();
  move_columns(slid_mm, way_s, P);
  add_noise(dt_s, freedom.sideways, C, P);
  forget_speed(dt_s, C, m, P);
  forget_drift(dt_s, freedom.drift, C, m, P);
}

void TubeMotion::forget_speed(double dt_s, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m,
                              Eigen::MatrixXd& P) const {
  const double kept = std::exp(-dt_s / kSpeedMemory_s);
  C(0, C.cols() - 1) = m(0, m.cols() - 1) * kept;
  m(0, m.cols() - 1) *= kept;
  P.row(speed_) *= kept;
  P.col(speed_) *= kept;
  P(speed_, speed_) += (1 - kept * kept) * kSpeed_mm_s * kSpeed_mm_s;
}

// The drift is a Gauss-Markov process and the way its integral: what velocities do within the step moves the
// tube as well.
void TubeMotion::forget_drift(double dt_s, const DriftVariances& drift, Eigen::Matrix3Xd& C,
                              Eigen::Matrix3Xd& m, Eigen::MatrixXd& P) const {
  const double kept = std::exp(-dt_s / kDriftMemory_s);
  m.middleCols(drift_ / 3, drift_count_) *= kept;
  C.middleCols(drift_ / 3, drift_count_) = m.middleCols(drift_ / 3, drift_count_);
  P.middleRows(drift_, 3 * drift_count_) *= kept;
  P.middleCols(drift_, 3 * drift_count_) *= kept;
  const double with_way = kDriftMemory_s * (1 - kept) * (1 - kept);
  const double way = kDriftMemory_s * (2 * dt_s - kDriftMemory_s * (3 - 4 * kept + kept * kept));
  for (Eigen::Index k = 0; k < drift_count_; ++k) {
    const Eigen::Index column = drift_ + 3 * k;
    P.diagonal().segment<3>(column).array() += (1 - kept * kept) * drift[k];
    for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
      const double share = drifting_(i, k) * drift[k];
      if (share == 0) {
        continue;
      }
      P.block<3, 3>(3 * i, column).diagonal().array() += with_way * share;
      P.block<3, 3>(column, 3 * i).diagonal().array() += with_way * share;
      for (Eigen::Index j = 0; j < coefficient_count_; ++j) {
        P.block<3, 3>(3 * i, 3 * j).diagonal().array() += way * share * drifting_(j, k);
      }
    }
  }
}

// The mean square of a velocity is that of its mean and its own variance. Of that a share alone: an axis of
// which nothing was measured would otherwise keep the variance up by having it.
void TubeMotion::learn_drift(double interval_s, double least, const Eigen::Matrix3Xd& m,
                             const Eigen::MatrixXd& P, DriftVariances& drift) const {
  constexpr double kUsual = kUsualDrift_mm_s * kUsualDrift_mm_s;
  const double share = std::clamp(interval_s / kDriftLearnt_s, 0.0, 1.0);
  for (Eigen::Index k = 0; k < drift_count_; ++k) {
    const double seen =
        m.col(drift_ / 3 + k).squaredNorm() + kUnseenShare * P.diagonal().segment<3>(drift_ + 3 * k).sum();
    drift[k] = std::clamp(drift[k] + share * (seen - drift[k]), least * kUsual, kMaxDrift * kUsual);
  }
}

void TubeMotion::add_noise(double dt_s, double freedom, const Eigen::Matrix3Xd& C, Eigen::MatrixXd& P) {
  const Eigen::Index n = coefficient_count_;
  for (Eigen::Index i = 0; i < n; ++i) {
    // d zeta / d sliding = -zeta'(s): toward the tip. The coefficient's own place stands for the curve there.
    const Eigen::Index before = std::max<Eigen::Index>(i - 1, 0);
    const Eigen::Index after = std::min<Eigen::Index>(i + 1, n - 1);
    sliding_.segment<3>(3 * i) =
        -(C.col(after) - C.col(before)) / (static_cast<double>(after - before) * spacing_mm_);
  }
  // The speed's own error slides the tube, together with what the speed does not foresee.
  const Eigen::Index moving = 3 * n;
  const double unforeseen_mm = kSlidingSpeed_mm_s * dt_s;
  const double variance_mm2 = dt_s * dt_s * P(speed_, speed_) + unforeseen_mm * unforeseen_mm;
  with_speed_ = P.col(speed_);  // before it is changed
  P.topRows(moving).noalias() += dt_s * sliding_.head(moving) * with_speed_.transpose();
  P.leftCols(moving).noalias() += dt_s * with_speed_ * sliding_.head(moving).transpose();
  P.topLeftCorner(moving, moving).noalias() +=
      variance_mm2 * sliding_.head(moving) * sliding_.head(moving).transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      P.block<3, 3>(3 * i, 3 * j).diagonal().array() += sideways_(i, j) * dt_s * freedom;
    }
  }
}

}  // namespace tubed
