#include "daemon/model/knot_point_spline.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

namespace tubed {
namespace {

Eigen::Matrix3Xd random_points_mm(int count, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 50);
  Eigen::Matrix3Xd points_mm(3, count);
  for (double& element : points_mm.reshaped()) element = normal(random);
  return points_mm;
}

/// Point at arc length s of a circle that starts at the origin along + x.
Eigen::Vector3d on_circle_mm(double radius_mm, double s_mm) {
  const double angle = s_mm / radius_mm;
  return {radius_mm * std::sin(angle), radius_mm * (1 - std::cos(angle)), 0};
}

Eigen::Matrix3Xd knot_points_on_circle(double radius_mm, double spacing_mm, int count) {
  Eigen::Matrix3Xd K_mm(3, count);
  for (int i = 0; i < count; ++i) K_mm.col(i) = on_circle_mm(radius_mm, i * spacing_mm);
  return K_mm;
}

Eigen::Matrix3Xd knot_points_on_line(double spacing_mm, int count) {
  Eigen::Matrix3Xd K_mm = Eigen::Matrix3Xd::Zero(3, count);
  K_mm.row(0) = Eigen::RowVectorXd::LinSpaced(count, 0, spacing_mm * (count - 1));
  return K_mm;
}

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

TEST(KnotPointSpline, SolvesTheSystemOfEq4) {
  std::mt19937 random(8);
  for (const int n : {4, 5, 8, 20}) {
    const Eigen::Matrix3Xd K_mm = random_points_mm(n, random);
    Eigen::MatrixXd eq4 = Eigen::MatrixXd::Identity(n, n);
    for (int i = 1; i + 1 < n; ++i) eq4.row(i).segment<3>(i - 1) << 1.0 / 6, 2.0 / 3, 1.0 / 6;
    const Eigen::Matrix3Xd expected_mm = (eq4.inverse() * K_mm.transpose()).transpose();

    EXPECT_LT((KnotPointSpline(K_mm).control_points_mm() - expected_mm).norm(), 1e-10) << n;
  }
}

TEST(KnotPointSpline, Eq3TakesTheControlPointsOfEq4BackToTheKnotPoints) {
  std::mt19937 random(9);
  for (int round = 0; round < 200; ++round) {
    const Eigen::Matrix3Xd K_mm = random_points_mm(4 + round % 20, random);

    const Eigen::Matrix3Xd back_mm =
        knot_points_from_control_points(KnotPointSpline(K_mm).control_points_mm());

    EXPECT_LT((back_mm - K_mm).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(KnotPointSpline, PassesThroughEveryKnotPoint) {
  std::mt19937 random(10);
  const Eigen::Matrix3Xd K_mm = random_points_mm(20, random);
  const KnotPointSpline spline(K_mm);

  EXPECT_EQ(spline.segment_count(), 21);
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT((spline.point(spline.parameter_of_knot_point(i)) - K_mm.col(i)).norm(), 1e-10) << i;
  }
}

TEST(KnotPointSpline, MovingTheKnotPointsIsTheSameAsStartingWithThem) {
  std::mt19937 random(11);
  const Eigen::Matrix3Xd K_mm = random_points_mm(12, random);
  KnotPointSpline moved(random_points_mm(12, random));

  moved.set_knot_points(K_mm);

  EXPECT_EQ(moved.control_points_mm(), KnotPointSpline(K_mm).control_points_mm());
}

TEST(KnotPointSpline, IsContinuousUpToTheSecondDerivativeAcrossItsJoints) {
  constexpr double kStep = 1e-9;
  std::mt19937 random(12);
  const KnotPointSpline spline(random_points_mm(9, random));
  for (int joint = 1; joint < spline.segment_count(); ++joint) {
    EXPECT_LT((spline.point(joint - kStep) - spline.point(joint + kStep)).norm(), 1e-5);
    EXPECT_LT((spline.derivative(joint - kStep) - spline.derivative(joint + kStep)).norm(), 1e-5);
    EXPECT_LT((spline.second_derivative(joint - kStep) - spline.second_derivative(joint + kStep)).norm(),
              1e-5);
  }
}

TEST(KnotPointSpline, ItsDerivativesAreFiniteDifferences) {
  constexpr double kStep = 1e-5;
  std::mt19937 random(13);
  const KnotPointSpline spline(random_points_mm(9, random));
  for (double u = 0.01; u < 10; u += 0.0913) {
    const Eigen::Vector3d velocity = (spline.point(u + kStep) - spline.point(u - kStep)) / (2 * kStep);
    const Eigen::Vector3d acceleration =
        (spline.derivative(u + kStep) - spline.derivative(u - kStep)) / (2 * kStep);

    EXPECT_LT((spline.derivative(u) - velocity).norm(), 1e-6);
    EXPECT_LT((spline.second_derivative(u) - acceleration).norm(), 1e-3);
  }
}

TEST(KnotPointSpline, StaysAtItsEndsForParametersBeyondThem) {
  std::mt19937 random(14);
  const Eigen::Matrix3Xd K_mm = random_points_mm(6, random);
  const KnotPointSpline spline(K_mm);

  EXPECT_LT((spline.point(-3) - K_mm.col(0)).norm(), 1e-12);
  EXPECT_LT((spline.point(99) - K_mm.col(5)).norm(), 1e-12);
}

TEST(KnotPointSplineTrap, TheJointAfterTheFirstKnotPointIsNoKnotPoint) {
  std::mt19937 random(15);
  const KnotPointSpline spline(random_points_mm(20, random));
  const Eigen::Matrix3Xd& C_mm = spline.control_points_mm();

  EXPECT_LT((spline.point(1) - (5.0 / 6 * C_mm.col(0) + 1.0 / 6 * C_mm.col(1))).norm(), 1e-12);
  EXPECT_GT((spline.point(1) - C_mm.col(0)).norm(), 1);
}

TEST(KnotPointSplineTrap, ThePointMeantAtTenMillimetresLiesAtThree) {
  const KnotPointSpline spline(knot_points_on_line(20, 20));
  const double halfway = (spline.parameter_of_knot_point(0) + spline.parameter_of_knot_point(1)) / 2;

  EXPECT_NEAR(spline.point(halfway).x(), 20.0 / 6, 1e-10);  // and not 10 mm
}

TEST(KnotPointSplineTrap, TheSpeedIsZeroAtTheEndsYetTheTangentIsItsLimit) {
  std::mt19937 random(16);
  const KnotPointSpline spline(random_points_mm(10, random));
  const double end = spline.segment_count();

  EXPECT_EQ(spline.derivative(0).norm(), 0);
  EXPECT_NEAR(spline.derivative(end).norm(), 0, 1e-12);
  EXPECT_LT((spline.unit_tangent(0) - spline.derivative(1e-3).normalized()).norm(), 1e-9);
  EXPECT_LT((spline.unit_tangent(end) - spline.derivative(end - 1e-3).normalized()).norm(), 1e-6);
  EXPECT_NEAR(spline.unit_tangent(0).norm(), 1, 1e-12);
}

TEST(KnotPointSplineTrap, TheEndSegmentsAreStraightWhateverTheCatheterDoes) {
  const KnotPointSpline spline(knot_points_on_circle(40, 20, 10));
  const double end = spline.segment_count();
  for (double u = 0; u <= 1; u += 0.05) {
    EXPECT_LT(spline.derivative(u).cross(spline.second_derivative(u)).norm(), 1e-9);
    EXPECT_EQ(spline.curvature_per_mm(u), 0);
    EXPECT_EQ(spline.curvature_per_mm(end - u * 0.999), 0);
  }
}

TEST(KnotPointSplineTrap, TheTipTangentIsEightDegreesWrongOnAnArchOf40Millimetres) {
  const KnotPointSpline spline(knot_points_on_circle(40, 20, 10));

  EXPECT_NEAR(degrees_between(spline.unit_tangent(0), Eigen::Vector3d::UnitX()), 8.4, 0.05);
}

TEST(KnotPointSpline, InsideACircleItHasTheCirclesCurvatureAndLength) {
  const KnotPointSpline spline(knot_points_on_circle(80, 10, 21));
  for (double u = 6; u <= 16; u += 0.1) EXPECT_NEAR(spline.curvature_per_mm(u) * 80, 1, 0.01) << u;
  EXPECT_NEAR(spline.arc_length_mm(6, 16), 100, 0.01);
  EXPECT_NEAR(spline.arc_length_mm(16, 6), -spline.arc_length_mm(6, 16), 1e-12);
  EXPECT_NEAR(spline.length_mm(), 200, 0.05);
}

TEST(KnotPointSpline, FindsTheParameterOfAnArcLength) {
  const KnotPointSpline spline(knot_points_on_circle(60, 15, 12));
  const double length_mm = spline.length_mm();
  for (double s_mm = 0; s_mm <= length_mm; s_mm += 1.7) {
    EXPECT_NEAR(spline.arc_length_mm(0, spline.parameter_at_arc_length(s_mm)), s_mm, 1e-10 * length_mm)
        << s_mm;
  }
  EXPECT_EQ(spline.parameter_at_arc_length(-1), 0);
  EXPECT_NEAR(spline.parameter_at_arc_length(length_mm + 1), spline.segment_count(), 1e-12);
}

/// A centreline on an arch of 80 mm radius in the default form, 380 mm long: 20 knot points are 20 mm apart.
struct Arch {
  UniformCubicBSpline spline{60, 380};
  Eigen::Matrix3Xd C_mm;
  Arch() {
    const Eigen::VectorXd s_mm = Eigen::VectorXd::LinSpaced(500, 0, 380);
    Eigen::Matrix3Xd p_mm(3, 500);
    for (Eigen::Index i = 0; i < 500; ++i) p_mm.col(i) = on_circle_mm(80, s_mm(i));
    C_mm = fit_coefficients(spline, s_mm, p_mm).value();
  }
};

/// Largest distance from the circle of 80 mm radius of a knot-point spline between two parameters.
double max_stray_mm(const KnotPointSpline& spline, double from, double to) {
  double max_mm = 0;
  for (double u = from; u <= to; u += 0.01) {
    const double distance_mm = (spline.point(u) - Eigen::Vector3d(0, 80, 0)).norm();
    max_mm = std::max(max_mm, std::abs(distance_mm - 80));
  }
  return max_mm;
}

TEST(KnotPointConversion, KnotPointsOfACentrelineLieOnItAndSoDoesTheirSpline) {
  const Arch arch;
  const KnotPointSpline spline(knot_points_on(arch.spline, arch.C_mm, 20));
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d meant_mm = on_circle_mm(80, 20 * i);
    EXPECT_LT((spline.point(spline.parameter_of_knot_point(i)) - meant_mm).norm(), 1e-4) << i;
  }
}

TEST(KnotPointConversion, BetweenTheKnotPointsItStraysByWhatTheHeaderSays) {
  const Arch arch;
  const KnotPointSpline coarse(knot_points_on(arch.spline, arch.C_mm, 20));  // every 20 mm
  const KnotPointSpline fine(knot_points_on(arch.spline, arch.C_mm, 39));    // every 10 mm

  EXPECT_LT(max_stray_mm(coarse, 5, 16), 0.002);
  EXPECT_LT(max_stray_mm(fine, 5, 35), 0.0005);
  EXPECT_NEAR(max_stray_mm(coarse, 0, 5), 0.23, 0.01);
  EXPECT_NEAR(max_stray_mm(fine, 0, 5), 0.057, 0.005);
}

TEST(KnotPointConversion, ThereAndBackIsAsGoodAsTheHeaderSays) {
  const Arch arch;
  const KnotPointSpline there(knot_points_on(arch.spline, arch.C_mm, 20));

  const auto back = arc_length_curve_of(there, 60);

  ASSERT_TRUE(back);
  const double length_mm = back->spline.length_mm();
  EXPECT_NEAR(length_mm, 380, 0.05);  // the straightened ends are shorter
  for (double s_mm = 0; s_mm <= length_mm; s_mm += 0.5) {
    const Eigen::Vector3d p_mm = point(back->spline, back->C_mm, s_mm);
    EXPECT_LT((p_mm - there.point(there.parameter_at_arc_length(s_mm))).norm(), 0.001) << s_mm;
    EXPECT_LT((p_mm - on_circle_mm(80, s_mm)).norm(), 0.24) << s_mm;
    EXPECT_NEAR(derivative(back->spline, back->C_mm, s_mm).norm(), 1, 0.0005) << s_mm;
  }
}

TEST(KnotPointConversion, ACurveOfNoLengthHasNoArcLengthForm) {
  EXPECT_FALSE(arc_length_curve_of(KnotPointSpline(Eigen::Matrix3Xd::Zero(3, 6)), 10));
}

}  // namespace
}  // namespace tubed
