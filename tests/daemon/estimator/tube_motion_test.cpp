#include "daemon/estimator/tube_motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

namespace tubed {
namespace {

constexpr int kCoefficients = 26;
constexpr double kLength_mm = 380;
constexpr double kRadius_mm = 60;

Eigen::Vector3d circle(double s_mm) {
  return {kRadius_mm * std::cos(s_mm / kRadius_mm), kRadius_mm * std::sin(s_mm / kRadius_mm), 0};
}

/// Nothing but what is known of its speed and of its drift moves the tube.
TubeMotion::Freedom held() {
  TubeMotion::Freedom freedom{1e-12, {}};
  for (Eigen::Index node = 0; node < TubeMotion::kMaxNodes; ++node) {
    freedom.drift[node] = 1e-12;
  }
  return freedom;
}

const int kColumns = kCoefficients + TubeMotion::column_count_of_motion(kLength_mm);

/// Coefficients whose curve is that circle up to the B-spline's own smoothing, no drift, and the speed.
Eigen::Matrix3Xd coefficients_of_circle(const UniformCubicBSpline& spline, double speed_mm_s) {
  Eigen::Matrix3Xd C = Eigen::Matrix3Xd::Zero(3, kColumns);
  for (int i = 0; i < kCoefficients; ++i) {
    C.col(i) = circle((i - 1) * spline.spacing_mm());
  }
  C(0, kColumns - 1) = speed_mm_s;
  return C;
}

Eigen::Vector3d point(const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C, double s_mm) {
  const CubicBasis basis = spline.basis(s_mm);
  return combine(C, basis.first, basis.value);
}

/// A tube on that circle, both means alike.
struct MovingTube {
  explicit MovingTube(double speed_mm_s) : C(coefficients_of_circle(spline, speed_mm_s)), m(C) {}
  void predict(double dt_s, const TubeMotion::Freedom& freedom = {}) {
    motion.predict(dt_s, freedom, C, m, P);
  }
  [[nodiscard]] double z_mm(double s_mm) const { return point(spline, m, s_mm).z(); }
  UniformCubicBSpline spline{kCoefficients, kLength_mm};
  TubeMotion motion{spline, kColumns};
  Eigen::Matrix3Xd C;
  Eigen::Matrix3Xd m;
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(3 * kColumns, 3 * kColumns);
};

TEST(TubeMotion, APushedTubeFollowsItself) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kColumns);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, 20);
  const Eigen::Matrix3Xd before = C;
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(C.size(), C.size());
  motion.predict(0.25, {}, C, m, P);
  for (double s = 30; s <= 350; s += 40) {
    EXPECT_LT((point(spline, C, s) - point(spline, before, s - 5)).norm(), 0.02) << s;
    EXPECT_LT((point(spline, m, s) - point(spline, before, s - 5)).norm(), 0.02) << s;
  }
}

TEST(TubeMotion, AtRestTheMeanStaysAndOnlyTheCovarianceGrows) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kColumns);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, 0);
  const Eigen::Matrix3Xd before = C;
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(C.size(), C.size());
  motion.predict(0.1, {}, C, m, P);
  EXPECT_LT((C - before).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(P(0, 0), 1.5);
  EXPECT_LT((P - P.transpose()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(TubeMotion, AJerkLoosensTheTubeWhereItWasAndNowhereElse) {
  MovingTube tube(0);
  const Eigen::MatrixXd before = tube.P;
  tube.motion.loosen([](double s_mm) { return std::abs(s_mm - 100) < 40 ? 9 : 0; }, tube.P);
  const Eigen::MatrixXd added = tube.P - before;
  const auto at = [&](double s_mm) {
    const auto i = static_cast<Eigen::Index>(std::lround(s_mm / tube.spline.spacing_mm())) + 1;
    return added(3 * i, 3 * i);
  };
  EXPECT_NEAR(at(100), 9, 1e-9);
  EXPECT_NEAR(at(70), 9, 1e-9);
  EXPECT_EQ(at(160), 0);
  const Eigen::Index here = 3 * (static_cast<Eigen::Index>(std::lround(100 / tube.spline.spacing_mm())) + 1);
  EXPECT_GT(added(here, here + 3), 5) << "neighbours go together";
  EXPECT_EQ(added(here, here + 1), 0) << "as far in each direction";
  EXPECT_LT((added - added.transpose()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(tube.P).eigenvalues().minCoeff(), 0.99);
  EXPECT_EQ(added.bottomRightCorner(3, 3).norm(), 0) << "its speed stays";
}

// What is known of a direction of the tube is known of the same piece of tube after it has slid.
TEST(TubeMotion, TheCovarianceSlidesWithTheTube) {
  MovingTube tube(UniformCubicBSpline(kCoefficients, kLength_mm).spacing_mm() / 0.01);
  const Eigen::Index motion_rows = 3 * TubeMotion::column_count_of_motion(kLength_mm);
  tube.P.bottomRightCorner(motion_rows, motion_rows).setZero();  // no drift
  tube.P.diagonal().segment<3>(3 * 10).setConstant(100);
  tube.P.bottomRightCorner<3, 3>().setIdentity();
  tube.predict(0.01, held());  // slides by one coefficient
  EXPECT_NEAR(tube.P(3 * 11 + 2, 3 * 11 + 2), 100, 1e-6);
  EXPECT_NEAR(tube.P(3 * 10 + 2, 3 * 10 + 2), 1, 1e-6);
}

TEST(TubeMotion, AnUnknownSpeedMakesTheTubeSlideByAnUnknownWay) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kColumns);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, 0);
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = 1e-6 * Eigen::MatrixXd::Identity(C.size(), C.size());
  motion.begin(C, P);
  const double sigma_speed_mm_s = std::sqrt(P(3 * (kColumns - 1), 3 * (kColumns - 1)));
  motion.predict(0.1, held(), C, m, P);
  const CubicBasis basis = spline.basis(200);
  const Eigen::Vector3d along = combine(C, basis.first, basis.first_derivative).normalized();
  double variance = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = 0; b < 4; ++b) {
      variance += basis.value[a] * basis.value[b] *
                  along.dot(P.block<3, 3>(3 * (basis.first + static_cast<int>(a)),
                                          3 * (basis.first + static_cast<int>(b))) *
                            along);
    }
  }
  EXPECT_GT(std::sqrt(variance), 0.9 * sigma_speed_mm_s * 0.1);
  EXPECT_LT(std::sqrt(variance), 1.3 * sigma_speed_mm_s * 0.1);
}

// A velocity at the tip's node alone: it fades, and beyond the next node nothing moves.
TEST(TubeMotion, AStretchThatDriftsGoesOnForAWhile) {
  MovingTube tube(0);
  tube.C(2, kCoefficients) = tube.m(2, kCoefficients) = 10;
  tube.predict(0.01);
  EXPECT_NEAR(tube.z_mm(0), 0.1 * 10 * 0.1, 0.03);
  EXPECT_NEAR(tube.z_mm(200), 0, 1e-12);
  for (int i = 0; i < 2000; ++i) {
    tube.predict(0.01);
  }
  EXPECT_GT(tube.z_mm(0), 4);
  EXPECT_LT(tube.z_mm(0), 10);
  EXPECT_LT(tube.m.col(kCoefficients).norm(), 1e-6);
  EXPECT_LT((tube.C - tube.m).cwiseAbs().maxCoeff(), 1e-12);
}

// Covariance: across the circle's plane, where nothing slides.
TEST(TubeMotion, WhatADriftDoesDoesNotDependOnTheSteps) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kColumns);
  Eigen::MatrixXd P;
  const auto after = [&](int steps, double velocity_mm_s) {
    Eigen::Matrix3Xd C = coefficients_of_circle(spline, 0);
    C.block(2, kCoefficients, 1, 3).setConstant(velocity_mm_s);
    Eigen::Matrix3Xd m = C;
    P.setIdentity(C.size(), C.size());
    for (int i = 0; i < steps; ++i) {
      motion.predict(0.2 / steps, {}, C, m, P);
    }
    return m;
  };
  const auto z_only = [&P] {
    return Eigen::MatrixXd(
        Eigen::Map<const Eigen::MatrixXd, 0, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>(
            P.data() + 2 * P.rows() + 2, kColumns - 1, kColumns - 1, {3 * P.rows(), 3}));
  };
  EXPECT_LT((after(20, 10) - after(1, 10)).cwiseAbs().maxCoeff(), 1e-9);
  after(1, 0);
  const Eigen::MatrixXd P_in_one = z_only();
  after(20, 0);
  EXPECT_LT((z_only() - P_in_one).cwiseAbs().maxCoeff(), 1e-9);
}

// Two points of a stretch that may drift move together, and so does what is known of them.
TEST(TubeMotion, AnUnknownDriftMovesAStretchTogether) {
  MovingTube tube(0);
  tube.P *= 1e-6;
  tube.motion.begin(tube.C, tube.P);
  tube.predict(0.2, {1e-12, {}});
  const auto z_covariance = [&tube](int a, int b) { return tube.P(3 * a + 2, 3 * b + 2); };
  EXPECT_GT(z_covariance(10, 10), 0.1);
  EXPECT_GT(z_covariance(10, 11), 0.8 * std::sqrt(z_covariance(10, 10) * z_covariance(11, 11)));
  EXPECT_LT(std::abs(z_covariance(2, 22)), 0.01 * z_covariance(10, 10));
  EXPECT_LT((tube.P - tube.P.transpose()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(TubeMotion, AVelocityIsForgottenUpToWhatIsUsual) {
  MovingTube tube(0);
  tube.P *= 1e-6;
  const double& variance = tube.P(3 * kCoefficients, 3 * kCoefficients);  // as if it had just been measured
  for (int i = 0; i < 2000; ++i) {
    tube.predict(0.01);
  }
  const double usual = TubeMotion::kUsualDrift_mm_s * TubeMotion::kUsualDrift_mm_s;
  EXPECT_NEAR(variance, usual, 1e-6 * usual);
}

/// The variance that a stretch's node is left with after 10 s of measurements, each of which finds it at
/// that velocity across the view, known to 0.1 mm/s, and with nothing of it known in depth.
double learnt_drift(const Eigen::Vector3d& velocity_mm_s, double least) {
  MovingTube tube(0);
  TubeMotion::DriftVariances drift;
  constexpr Eigen::Index kNode = 2;
  for (int i = 0; i < 400; ++i) {
    tube.m.col(kCoefficients + kNode) = velocity_mm_s;
    tube.P.diagonal().segment<3>(3 * (kCoefficients + kNode)) << 0.01, 0.01, drift[kNode];
    tube.motion.learn_drift(0.025, least, tube.m, tube.P, drift);
  }
  return drift[kNode];
}

TEST(TubeMotion, AStretchThatRestsIsHeldAndOneThatIsSeenToMoveIsFree) {
  constexpr double kUsual = TubeMotion::kUsualDrift_mm_s * TubeMotion::kUsualDrift_mm_s;
  EXPECT_NEAR(learnt_drift(Eigen::Vector3d::Zero(), 0.05), 0.05 * kUsual, 1e-6);
  EXPECT_NEAR(learnt_drift(Eigen::Vector3d::Zero(), 1), kUsual, 1e-6);
  const double at_5_mm_s = learnt_drift({3, 4, 0}, 0.05);
  EXPECT_GT(at_5_mm_s, 25);
  EXPECT_LT(at_5_mm_s, 30);
  const double at_50_mm_s = learnt_drift({50, 0, 0}, 0.05);
  EXPECT_GT(at_50_mm_s, 2 * kUsual);
  EXPECT_LT(at_50_mm_s, 10 * kUsual);
}

TEST(TubeMotion, HowFastOneStretchDriftsSaysNothingOfTheOthers) {
  MovingTube tube(0);
  tube.P *= 1e-6;
  TubeMotion::DriftVariances drift;
  tube.m.col(kCoefficients) << 10, 0, 0;
  for (int i = 0; i < 400; ++i) {
    tube.motion.learn_drift(0.025, 0.05, tube.m, tube.P, drift);
  }
  EXPECT_NEAR(drift[0], 100, 1);
  tube.m.col(kCoefficients).setZero();
  tube.motion.begin(tube.C, tube.P);
  tube.predict(0.5, {1e-12, drift});
  const auto z_variance = [&tube](int i) { return tube.P(3 * i + 2, 3 * i + 2); };
  EXPECT_GT(z_variance(0), 1.2 * z_variance(20));
}

// As long as nothing is measured the variances stay: a second of silence is no rest.
TEST(TubeMotion, NothingIsLearntInNoTime) {
  MovingTube tube(0);
  TubeMotion::DriftVariances drift;
  tube.motion.learn_drift(0, 0.05, tube.m, tube.P, drift);
  EXPECT_EQ(drift[0], TubeMotion::kUsualDrift_mm_s * TubeMotion::kUsualDrift_mm_s);
}

// A departure d of the mean becomes F d, and d d^T becomes F d d^T F^T beside the noise. Any d without speed,
// in which the mean is not linear.
TEST(TubeMotion, TheCovarianceMovesAsTheMeanDoes) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kColumns);
  const Eigen::Matrix3Xd before = coefficients_of_circle(spline, 30);
  Eigen::Matrix3Xd d(3, kColumns);
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    d(i) = std::sin(1 + 2.3 * static_cast<double>(i));
  }
  d.rightCols<1>().setZero();
  const auto moved = [&](const Eigen::Matrix3Xd& mean, Eigen::MatrixXd& P) {
    Eigen::Matrix3Xd C = before;
    Eigen::Matrix3Xd m = mean;
    motion.predict(0.1, {}, C, m, P);
    return m;
  };
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(before.size(), before.size());
  Eigen::MatrixXd P = d.reshaped() * d.reshaped().transpose();
  Eigen::MatrixXd unused = P;
  moved(before + d, noise);
  const Eigen::Matrix3Xd Fd = moved(before + d, P) - moved(before, unused);
  const Eigen::MatrixXd expected = Fd.reshaped() * Fd.reshaped().transpose();
  EXPECT_LT((P - noise - expected).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace tubed
