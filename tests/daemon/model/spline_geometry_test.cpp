#include "daemon/model/spline_geometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace tubed {
namespace {

/// Helix of radius r about z rising 2 pi c a turn, in arc length; a circle for c = 0.
/// Closed forms: curvature r / (r^2 + c^2); the tangent's z component c / sqrt(r^2 + c^2).
struct Helix {
  double r_mm;
  double c_mm;
  [[nodiscard]] Eigen::Vector3d operator()(double s_mm) const {
    const double angle = s_mm / std::hypot(r_mm, c_mm);
    return {r_mm * std::cos(angle), r_mm * std::sin(angle), c_mm * angle};
  }
  [[nodiscard]] Eigen::Vector3d tangent(double s_mm) const {
    const double w_mm = std::hypot(r_mm, c_mm);
    const double angle = s_mm / w_mm;
    return Eigen::Vector3d(-r_mm * std::sin(angle), r_mm * std::cos(angle), c_mm) / w_mm;
  }
  [[nodiscard]] double curvature_per_mm() const { return r_mm / (r_mm * r_mm + c_mm * c_mm); }
};

Eigen::Matrix3Xd fitted(const UniformCubicBSpline& spline, const Helix& helix) {
  const Eigen::VectorXd s_mm = Eigen::VectorXd::LinSpaced(400, 0, spline.length_mm());
  Eigen::Matrix3Xd p_mm(3, s_mm.size());
  for (Eigen::Index i = 0; i < s_mm.size(); ++i) p_mm.col(i) = helix(s_mm(i));
  return fit_coefficients(spline, s_mm, p_mm).value();
}

Eigen::Matrix3Xd random_coefficients(int count, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 20);
  Eigen::Matrix3Xd C_mm(3, count);
  for (double& element : C_mm.reshaped()) element = normal(random);
  return C_mm;
}

void expect_geometry_of(const Helix& helix, double length_mm) {
  const UniformCubicBSpline spline(24, length_mm);
  const Eigen::Matrix3Xd C_mm = fitted(spline, helix);

  for (double s_mm = 0; s_mm <= length_mm; s_mm += length_mm / 97) {
    EXPECT_LT((point(spline, C_mm, s_mm) - helix(s_mm)).norm(), 5e-4) << s_mm;
    EXPECT_LT((unit_tangent(spline, C_mm, s_mm) - helix.tangent(s_mm)).norm(), 5e-4) << s_mm;
    EXPECT_NEAR(curvature_per_mm(spline, C_mm, s_mm) / helix.curvature_per_mm(), 1, 0.02) << s_mm;
    EXPECT_NEAR(arc_length_mm(spline, C_mm, 0, s_mm), s_mm, 1e-3) << s_mm;
  }
}

TEST(SplineGeometry, ACircleHasItsRadiusItsTangentAndItsLength) { expect_geometry_of(Helix{80, 0}, 200); }

TEST(SplineGeometry, AHelixHasItsCurvatureItsTangentAndItsLength) { expect_geometry_of(Helix{60, 25}, 200); }

TEST(SplineGeometry, ALineHasNoCurvatureAndItsOwnLength) {
  const UniformCubicBSpline spline(6, 90);
  Eigen::Matrix3Xd C_mm(3, 6);
  for (int i = 0; i < 6; ++i) C_mm.col(i) = Eigen::Vector3d(3, 4, 0) / 5 * 30 * (i - 1);

  EXPECT_NEAR(curvature_per_mm(spline, C_mm, 33), 0, 1e-14);
  EXPECT_NEAR(arc_length_mm(spline, C_mm, 10, 85), 75, 1e-12);
  EXPECT_NEAR(arc_length_mm(spline, C_mm, -5, 95), 100, 1e-12);
  EXPECT_NEAR(arc_length_mm(spline, C_mm, 85, 10), -75, 1e-12);
}

TEST(SplineGeometry, DerivativesAreFiniteDifferences) {
  constexpr double kStep_mm = 1e-4;
  const UniformCubicBSpline spline(10, 200);
  std::mt19937 random(5);
  const Eigen::Matrix3Xd C_mm = random_coefficients(10, random);
  for (double s_mm = 1; s_mm < 200; s_mm += 3.7) {
    const Eigen::Vector3d velocity =
        (point(spline, C_mm, s_mm + kStep_mm) - point(spline, C_mm, s_mm - kStep_mm)) / (2 * kStep_mm);
    const Eigen::Vector3d acceleration =
        (derivative(spline, C_mm, s_mm + kStep_mm) - derivative(spline, C_mm, s_mm - kStep_mm)) /
        (2 * kStep_mm);

    EXPECT_LT((derivative(spline, C_mm, s_mm) - velocity).norm(), 1e-8);
    EXPECT_LT((second_derivative(spline, C_mm, s_mm) - acceleration).norm(), 1e-5);
  }
}

TEST(SplineGeometry, CurvatureDoesNotDependOnTheSpeed) {
  const UniformCubicBSpline spline(10, 200);
  const UniformCubicBSpline slower(10, 400);  // the same curve, passed at half the speed
  std::mt19937 random(6);
  const Eigen::Matrix3Xd C_mm = random_coefficients(10, random);

  for (double s_mm = 1; s_mm < 200; s_mm += 3.7) {
    const double curvature = curvature_per_mm(spline, C_mm, s_mm);
    EXPECT_NEAR(curvature_per_mm(slower, C_mm, 2 * s_mm), curvature, 1e-9 * (1 + curvature));
  }
}

TEST(SplineGeometry, ArcLengthsOfPartsAddUpToThatOfTheWhole) {
  const UniformCubicBSpline spline(24, 200);
  const Eigen::Matrix3Xd C_mm = fitted(spline, Helix{60, 25});
  const double whole_mm = arc_length_mm(spline, C_mm, 0, 200);

  for (double cut_mm = 0; cut_mm <= 200; cut_mm += 6.1) {
    const double parts_mm = arc_length_mm(spline, C_mm, 0, cut_mm) + arc_length_mm(spline, C_mm, cut_mm, 200);
    EXPECT_NEAR(parts_mm, whole_mm, 1e-9 * whole_mm);
  }
}

TEST(FitCoefficients, RecoversTheCoefficientsThatMadeTheSamples) {
  const UniformCubicBSpline spline(12, 300);
  std::mt19937 random(7);
  const Eigen::Matrix3Xd C_mm = random_coefficients(12, random);
  const Eigen::VectorXd s_mm = Eigen::VectorXd::LinSpaced(40, 0, 300);
  Eigen::Matrix3Xd p_mm(3, 40);
  for (Eigen::Index i = 0; i < 40; ++i) p_mm.col(i) = point(spline, C_mm, s_mm(i));

  const auto fit = fit_coefficients(spline, s_mm, p_mm);

  ASSERT_TRUE(fit);
  EXPECT_LT((*fit - C_mm).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(FitCoefficients, SamplesThatLeaveACoefficientFreeAreRefused) {
  const UniformCubicBSpline spline(12, 300);
  const Eigen::VectorXd front_half_mm = Eigen::VectorXd::LinSpaced(40, 0, 150);
  const Eigen::VectorXd too_few_mm = Eigen::VectorXd::LinSpaced(11, 0, 300);

  EXPECT_FALSE(fit_coefficients(spline, front_half_mm, Eigen::Matrix3Xd::Zero(3, 40)));
  EXPECT_FALSE(fit_coefficients(spline, too_few_mm, Eigen::Matrix3Xd::Zero(3, 11)));
}

TEST(FitCoefficients, SamplesThatAreNotNumbersAreRefused) {
  const UniformCubicBSpline spline(12, 300);
  Eigen::VectorXd s_mm = Eigen::VectorXd::LinSpaced(40, 0, 300);
  s_mm(3) = std::nan("");

  EXPECT_FALSE(fit_coefficients(spline, s_mm, Eigen::Matrix3Xd::Zero(3, 40)));
}

}  // namespace
}  // namespace tubed
