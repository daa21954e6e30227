// What stays of the coils' errors, as the recursive estimator carries it on.
#include <algorithm>
#include <cmath>

#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

// A coil's lasting error changes as the coil moves through the field.
constexpr double kErrorLength_mm = 1000;
constexpr double kErrorMemory_s = 10;  // so that a drift does not stay for ever

}  // namespace

void RecursiveEstimator::place_coils() {
  for (std::size_t i = 0; i < instrument_.coils.size(); ++i) {
    const CubicBasis basis = map_.spline().basis(instrument_.coils[i].offset_from_tip_mm);
    state_.coil_places_mm[i] = combine(state_.C, basis.first, basis.value);
  }
}

// A Gauss-Markov process over the way each coil has gone. If more of the error turns out to stay than was
// thought, that much is added; if less than ever, each coil's error is known to be as much smaller. Not if
// less than a moment ago: a figure that wavers would tell the same again and again.
void RecursiveEstimator::age_coil_errors(double dt_s) {
  const double was_position_mm = state_.lasting_position_mm;
  const double was_tangent = state_.lasting_tangent;
  state_.lasting_position_mm = state_.noise.lasting_position_mm(state_.error_scale.position_mm());
  state_.lasting_tangent = state_.noise.lasting_tangent(state_.error_scale.tangent());
  const double min_position_mm = state_.min_lasting_position_mm;
  const double min_tangent = state_.min_lasting_tangent;
  state_.min_lasting_position_mm = std::min(min_position_mm, state_.lasting_position_mm);
  state_.min_lasting_tangent = std::min(min_tangent, state_.lasting_tangent);
  const std::array<Eigen::Vector3d, kMaxCoils> before_mm = state_.coil_places_mm;
  place_coils();
  for (std::size_t i = 0; i < instrument_.coils.size(); ++i) {
    const double kept =
        std::exp(-(state_.coil_places_mm[i] - before_mm[i]).norm() / kErrorLength_mm - dt_s / kErrorMemory_s);
    const auto age = [&](int column, double sigma, double was, double least) {
      state_.C.col(column) *= kept;
      state_.m.col(column) *= kept;
      state_.P.middleRows<3>(3 * column) *= kept;
      state_.P.middleCols<3>(3 * column) *= kept;
      state_.P.block<3, 3>(3 * column, 3 * column).diagonal().array() +=
          (1 - kept * kept) * sigma * sigma + std::max(0.0, sigma * sigma - was * was);
      if (sigma < least) {
        tighten(column, 1 / (1 / (sigma * sigma) - 1 / (least * least)));
      }
    };
    age(map_.position_error_column(static_cast<int>(i)), state_.lasting_position_mm, was_position_mm,
        min_position_mm);
    age(map_.tangent_error_column(static_cast<int>(i)), state_.lasting_tangent, was_tangent, min_tangent);
  }
}

// What a measurement of zero with this variance an axis would do.
void RecursiveEstimator::tighten(int column, double variance) {
  const Eigen::Matrix3d S =
      state_.P.block<3, 3>(3 * column, 3 * column) + variance * Eigen::Matrix3d::Identity();
  auto gain = scratch_.leftCols<3>();
  auto covariance = scratch_.middleCols<3>(3);
  covariance = state_.P.middleCols<3>(3 * column);
  gain.noalias() = covariance * S.inverse();
  for (Eigen::Matrix3Xd* mean : {&state_.C, &state_.m}) {
    const Eigen::Vector3d error = mean->col(column);
    Eigen::Map<Eigen::VectorXd>(mean->data(), mean->size()).noalias() -= gain * error;
  }
  state_.P.noalias() -= gain * covariance.transpose();
}

}  // namespace tubed
