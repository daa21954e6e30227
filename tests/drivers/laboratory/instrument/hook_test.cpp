#include "drivers/laboratory/instrument/hook.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "drivers/laboratory/instrument/catheter_shape.hpp"

namespace tubed {
namespace {

constexpr double kSpacing_mm = 3.125;
constexpr Eigen::Index kNodes = 20;

/// Toward a direction that is carried along, at right angles to each edge.
Eigen::Matrix3Xd toward(const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& direction) {
  Eigen::Matrix3Xd at_edges(3, nodes.cols() - 1);
  for (Eigen::Index edge = 0; edge < at_edges.cols(); ++edge) {
    const Eigen::Vector3d t = (nodes.col(edge) - nodes.col(edge + 1)).normalized();
    at_edges.col(edge) = (direction - direction.dot(t) * t).normalized();
  }
  return at_edges;
}

/// Along z, the tip on top.
Eigen::Matrix3Xd straight_chain() {
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, kNodes);
  for (Eigen::Index i = 0; i < kNodes; ++i) nodes(2, i) = -kSpacing_mm * static_cast<double>(i);
  return nodes;
}

/// The chain whose CatheterShape is a circle of that radius in x-z, turning toward x.
Eigen::Matrix3Xd circular_chain(double radius_mm) {
  const double turn_rad = kSpacing_mm / radius_mm;
  const double edge_mm = 2 * CatheterShape::half_edge_mm(turn_rad, kSpacing_mm);
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, kNodes);
  for (Eigen::Index i = kNodes - 2; i >= 0; --i) {
    const double angle = turn_rad * static_cast<double>(kNodes - 2 - i);
    nodes.col(i) = nodes.col(i + 1) + edge_mm * Eigen::Vector3d(std::sin(angle), 0, std::cos(angle));
  }
  return nodes;
}

TEST(Hook, OfAStraightChainItIsItsCircle) {
  const Eigen::Matrix3Xd nodes = straight_chain();
  const Hook hook{RestCurve::hook(8, 14), 0};
  const CatheterShape shape(with_hook(nodes, kSpacing_mm, hook, toward(nodes, Eigen::Vector3d::UnitY())),
                            kSpacing_mm);
  const CatheterShape before(nodes, kSpacing_mm);

  // The last half spacing is straight, so that the circle is 14 - 1.5625 mm long; a node's arc is the
  // smallest piece, so that the circle begins up to a spacing sooner and is that much wider there.
  const double turned_rad = (14 - kSpacing_mm / 2) / 8;
  const Eigen::Vector3d tangent = shape.at(0).tangent_world;
  EXPECT_LT((tangent - Eigen::Vector3d(0, std::sin(turned_rad), std::cos(turned_rad))).norm(), 1e-9);
  const Eigen::Vector3d begin = before.at(14).p_world_mm;
  for (double s_mm = 2; s_mm < 13; s_mm += 0.5) {
    EXPECT_NEAR((shape.at(s_mm).p_world_mm - begin - Eigen::Vector3d(0, 8, 0)).norm(), 8, 0.2) << s_mm;
  }
  for (double s_mm = 17; s_mm < 50; s_mm += 1) {
    EXPECT_LT((shape.at(s_mm).p_world_mm - before.at(s_mm).p_world_mm).norm(), 1e-9) << s_mm;
  }
}

TEST(Hook, TheCurveHasTheMaterialsLengthAndNoCorner) {
  const Eigen::Matrix3Xd nodes = circular_chain(40);
  const CatheterShape shape(
      with_hook(nodes, kSpacing_mm, {RestCurve::hook(6, 18), 0}, toward(nodes, Eigen::Vector3d(0.5, 1, 0.1))),
      kSpacing_mm);
  constexpr double kStep_mm = 0.01;
  for (double s_mm = 0; s_mm < 50; s_mm += kStep_mm) {
    const ShapePoint here = shape.at(s_mm);
    const ShapePoint ahead = shape.at(s_mm + kStep_mm);
    ASSERT_NEAR((here.p_world_mm - ahead.p_world_mm).norm(), kStep_mm, 1e-5) << s_mm;
    ASSERT_LT((here.tangent_world - ahead.tangent_world).norm(), 0.01) << s_mm;
  }
}

TEST(Hook, InThePlaneOfTheChainsCircleCurvaturesAdd) {
  const Eigen::Matrix3Xd nodes = circular_chain(40);
  Eigen::Matrix3Xd inward(3, kNodes - 1);
  for (Eigen::Index edge = 0; edge < kNodes - 1; ++edge) {
    const Eigen::Vector3d t = (nodes.col(edge) - nodes.col(edge + 1)).normalized();
    inward.col(edge) = Eigen::Vector3d::UnitY().cross(t);  // from z toward x: to the circle's middle
  }
  for (const double side : {1.0, -1.0}) {
    const CatheterShape shape(with_hook(nodes, kSpacing_mm, {RestCurve::hook(20, 25), 0}, side * inward),
                              kSpacing_mm);
    const double turned_rad =
        std::acos(shape.at(5).tangent_world.dot(shape.at(5 + 2 * kSpacing_mm).tangent_world));
    EXPECT_NEAR(turned_rad, 2 * kSpacing_mm * std::abs(1.0 / 40 + side / 20), 1e-6);
  }
}

// 9.375 mm to one side, as much straight, and as much to the other one: it runs as before, further aside.
TEST(Hook, ArcsToBothSidesEndParallelToTheChain) {
  const Eigen::Matrix3Xd nodes = straight_chain();
  constexpr double kArc_mm = 3 * kSpacing_mm;
  const double first_mm = kArc_mm + kSpacing_mm / 2;  // of which the last half spacing is straight
  const Hook hook{{{{first_mm, -12}, {kArc_mm, 0}, {kArc_mm, 12}}}, 0};
  const CatheterShape shape(with_hook(nodes, kSpacing_mm, hook, toward(nodes, Eigen::Vector3d::UnitY())),
                            kSpacing_mm);
  const double turned_rad = kArc_mm / 12;
  EXPECT_LT((shape.at(0).tangent_world - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  const Eigen::Vector3d between = shape.at(first_mm + kArc_mm / 2).tangent_world;
  EXPECT_LT((between - Eigen::Vector3d(0, std::sin(turned_rad), std::cos(turned_rad))).norm(), 1e-9);
  const double aside_mm = shape.at(0).p_world_mm.y() - CatheterShape(nodes, kSpacing_mm).at(0).p_world_mm.y();
  EXPECT_NEAR(aside_mm, 2 * 12 * (1 - std::cos(turned_rad)) + kArc_mm * std::sin(turned_rad), 0.1);
}

TEST(Hook, WithoutOneNothingChanges) {
  const Eigen::Matrix3Xd nodes = circular_chain(40);
  EXPECT_EQ(with_hook(nodes, kSpacing_mm, {}, toward(nodes, Eigen::Vector3d::UnitY())), nodes);
}

}  // namespace
}  // namespace tubed
