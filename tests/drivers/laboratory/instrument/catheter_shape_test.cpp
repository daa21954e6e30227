#include "drivers/laboratory/instrument/catheter_shape.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace tubed {
namespace {

constexpr double kSpacing_mm = 3;

/// Nodes whose arcs all lie on one circle of `radius_mm`: corners of a polygon around it.
CatheterShape circle(double radius_mm, int nodes) {
  const double turn = kSpacing_mm / radius_mm;
  const double corner_mm = radius_mm / std::cos(turn / 2);
  Eigen::Matrix3Xd corners(3, nodes);
  for (int i = 0; i < nodes; ++i) {
    corners.col(i) = corner_mm * Eigen::Vector3d(std::cos(i * turn), std::sin(i * turn), 0);
  }
  return {corners, kSpacing_mm};
}

TEST(CatheterShape, ArcsOfAPolygonAroundACircleAreTheCircle) {
  const CatheterShape shape = circle(20, 30);
  for (double s_mm = kSpacing_mm / 2; s_mm < shape.length_mm(); s_mm += 0.37) {
    const ShapePoint point = shape.at(s_mm);
    EXPECT_NEAR(point.p_world_mm.norm(), 20, 1e-9) << s_mm;
    EXPECT_NEAR(point.tangent_world.dot(point.p_world_mm), 0, 1e-9) << s_mm;
    const double angle = std::atan2(point.p_world_mm.y(), point.p_world_mm.x());
    EXPECT_NEAR(std::remainder(angle - s_mm / 20, 2 * std::numbers::pi), 0, 1e-9) << s_mm;
  }
}

TEST(CatheterShape, TheTangentPointsTowardTheTipAndTheEndsGoStraightOn) {
  const CatheterShape shape = circle(20, 30);
  EXPECT_GT(shape.at(30).tangent_world.dot(shape.at(29).p_world_mm - shape.at(31).p_world_mm), 1.99);
  const ShapePoint tip = shape.at(0);
  EXPECT_LT((shape.at(-2).p_world_mm - tip.p_world_mm - 2 * tip.tangent_world).norm(), 1e-12);
  const ShapePoint end = shape.at(shape.length_mm());
  EXPECT_LT((shape.at(shape.length_mm() + 5).p_world_mm - end.p_world_mm + 5 * end.tangent_world).norm(),
            1e-9);
}

TEST(CatheterShape, ItIsAsLongAsItsParameterSays) {
  const CatheterShape shape = circle(15, 40);
  double length_mm = 0;
  for (int i = 0; i < 1000; ++i) {
    length_mm += (shape.at(0.1 * i + 0.1).p_world_mm - shape.at(0.1 * i).p_world_mm).norm();
  }
  EXPECT_NEAR(length_mm, 100, 100 * 1e-4);
}

}  // namespace
}  // namespace tubed
