#include "daemon/estimator/tube_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

constexpr int kCoefficients = 26;
constexpr double kLength_mm = 380;
constexpr double kRadius_mm = 60;

Eigen::Vector3d circle(double s_mm) {
  return {kRadius_mm * std::cos(s_mm / kRadius_mm), kRadius_mm * std::sin(s_mm / kRadius_mm), 0};
}

/// Coefficients whose curve is that circle up to the B-spline's own smoothing, and one column of speed.
Eigen::Matrix3Xd coefficients_of_circle(const UniformCubicBSpline& spline, double speed_mm_s) {
  Eigen::Matrix3Xd C = Eigen::Matrix3Xd::Zero(3, kCoefficients + 1);
  for (int i = 0; i < kCoefficients; ++i) {
    C.col(i) = circle((i - 1) * spline.spacing_mm());
  }
  C(0, kCoefficients) = speed_mm_s;
  return C;
}

Eigen::Vector3d point(const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C, double s_mm) {
  const CubicBasis basis = spline.basis(s_mm);
  return combine(C, basis.first, basis.value);
}

TEST(TubeMotion, APushedTubeFollowsItself) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kCoefficients + 1);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, 20);
  const Eigen::Matrix3Xd before = C;
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(C.size(), C.size());
  motion.predict(0.25, 1, C, m, P);
  for (double s = 30; s <= 350; s += 40) {
    EXPECT_LT((point(spline, C, s) - point(spline, before, s - 5)).norm(), 0.02) << s;
    EXPECT_LT((point(spline, m, s) - point(spline, before, s - 5)).norm(), 0.02) << s;
  }
}

TEST(TubeMotion, AtRestTheMeanStaysAndOnlyTheCovarianceGrows) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kCoefficients + 1);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, 0);
  const Eigen::Matrix3Xd before = C;
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(C.size(), C.size());
  motion.predict(0.1, 1, C, m, P);
  EXPECT_LT((C - before).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(P(0, 0), 1.5);
  EXPECT_LT((P - P.transpose()).cwiseAbs().maxCoeff(), 1e-9);
}

// What is known of a direction of the tube is known of the same piece of tube after it has slid.
TEST(TubeMotion, TheCovarianceSlidesWithTheTube) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kCoefficients + 1);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, spline.spacing_mm() / 0.01);
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = Eigen::MatrixXd::Identity(C.size(), C.size());
  P.diagonal().segment<3>(3 * 10).setConstant(100);
  P.bottomRightCorner<3, 3>().setIdentity();
  motion.predict(0.01, 1e-9, C, m, P);  // slides by one coefficient
  EXPECT_NEAR(P(3 * 11 + 2, 3 * 11 + 2), 100, 1e-6);
  EXPECT_NEAR(P(3 * 10 + 2, 3 * 10 + 2), 1, 1e-6);
}

TEST(TubeMotion, AnUnknownSpeedMakesTheTubeSlideByAnUnknownWay) {
  const UniformCubicBSpline spline(kCoefficients, kLength_mm);
  TubeMotion motion(spline, kCoefficients + 1);
  Eigen::Matrix3Xd C = coefficients_of_circle(spline, 0);
  Eigen::Matrix3Xd m = C;
  Eigen::MatrixXd P = 1e-6 * Eigen::MatrixXd::Identity(C.size(), C.size());
  motion.begin(C, P);
  const double sigma_speed_mm_s = std::sqrt(P(3 * kCoefficients, 3 * kCoefficients));
  motion.predict(0.1, 1e-12, C, m, P);
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

}  // namespace
}  // namespace tubed
