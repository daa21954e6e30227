#include "drivers/laboratory/vessel/wall_field.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "drivers/laboratory/vessel/vessel.hpp"

namespace tubed {
namespace {

/// A straight tube along z, radius 10 mm.
WallField tube() {
  std::vector<LumenBall> balls;
  append_tube({{{1, 2, -60}, 10}, {{1, 2, 60}, 10}}, balls);
  return WallField::of_balls(balls);
}

TEST(WallField, DistanceInATubeIsRadiusMinusDistanceFromItsAxis) {
  const WallField field = tube();
  // Smoothing lifts the middle of a concave wall by spacing^2 / 6 / R: 0.04 mm.
  for (const double from_axis : {7.0, 9.0, 10.0, 11.0, 14.0}) {
    EXPECT_NEAR(field.distance_mm({1 + from_axis, 2, 5}), 10 - from_axis, 0.1) << from_axis;
    EXPECT_NEAR(field.distance_mm({1, 2 - from_axis, -21}), 10 - from_axis, 0.1) << from_axis;
  }
  EXPECT_TRUE(field.contains({1, 2, 0}));
  EXPECT_FALSE(field.contains({1, 13, 0}));
}

TEST(WallField, FarOutsideTheDistanceGoesOnFallingAndTheGradientPointsBack) {
  const WallField field = tube();
  EXPECT_LT(field.distance_mm({200, 2, 0}), -100);
  EXPECT_LT(field.at({200, 2, 0}).gradient.x(), -0.9);
}

TEST(WallField, DerivativesAreThoseOfTheDistance) {
  const WallField field = tube();
  const Eigen::Vector3d p_mm(6.3, -4.1, 12.7);
  const WallDistance wall = field.at(p_mm);
  EXPECT_EQ(wall.distance_mm, field.distance_mm(p_mm));
  constexpr double kStep_mm = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep_mm * Eigen::Vector3d::Unit(axis);
    const double slope = (field.distance_mm(p_mm + step) - field.distance_mm(p_mm - step)) / (2 * kStep_mm);
    EXPECT_NEAR(wall.gradient[axis], slope, 1e-6);
    const Eigen::Vector3d curvature =
        (field.at(p_mm + step).gradient - field.at(p_mm - step).gradient) / (2 * kStep_mm);
    EXPECT_LT((wall.hessian_per_mm.col(axis) - curvature).norm(), 1e-5) << axis;
  }
}

TEST(WallField, NoLumenIsRefused) {
  EXPECT_THROW(WallField::of_balls({}), std::invalid_argument);
  const LumenBall flat{{0, 0, 0}, 0};
  EXPECT_THROW(WallField::of_balls({&flat, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace tubed
