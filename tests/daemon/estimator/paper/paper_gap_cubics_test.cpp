#include "daemon/estimator/paper/paper_gap_cubics.hpp"

#include <gtest/gtest.h>

#include "daemon/model/gauss_legendre.hpp"

namespace tubed {
namespace {

/// A cubic: every piecewise cubic repeats it exactly, also beyond its nodes.
Eigen::Vector3d cubic(double s) { return {0.001 * s * s * s, s - 3, 2 - 0.01 * s * s}; }
Eigen::Vector3d slope(double s) { return {0.003 * s * s, 1, -0.02 * s}; }
Eigen::Vector3d second(double s) { return {0.006 * s, 0, -0.02}; }

Eigen::Matrix3Xd nodes_on_cubic(const GapCubics& cubics) {
  Eigen::Matrix3Xd nodes(3, 2 * cubics.node_count());
  for (int i = 0; i < cubics.node_count(); ++i) {
    nodes.col(2 * i) = cubic(cubics.node_s_mm(i));
    nodes.col(2 * i + 1) = slope(cubics.node_s_mm(i));
  }
  return nodes;
}

TEST(GapCubics, RepeatACubicBetweenAndBeyondTheirCoils) {
  const GapCubics cubics({10, 90, 170, 270});
  const Eigen::Matrix3Xd nodes = nodes_on_cubic(cubics);
  for (const double s : {0.0, 10.0, 37.0, 90.0, 169.0, 200.0, 270.0, 280.0}) {
    const GapBasis at = cubics.basis(s);
    EXPECT_LT((combine(nodes, at, at.value) - cubic(s)).norm(), 1e-7) << s;
    EXPECT_LT((combine(nodes, at, at.first_derivative) - slope(s)).norm(), 1e-8) << s;
    EXPECT_LT((combine(nodes, at, at.second_derivative) - second(s)).norm(), 1e-9) << s;
  }
}

TEST(GapCubics, BendingIsTheIntegralOfTheSquaredSecondDerivative) {
  const GapCubics cubics({10, 90, 170, 270});
  const Eigen::Matrix3Xd nodes = nodes_on_cubic(cubics);
  const double by_matrix = (nodes * cubics.bending(280) * nodes.transpose()).trace();
  const double by_quadrature =
      integrate_gauss_legendre(0, 280, [](double s) { return second(s).squaredNorm(); });
  EXPECT_NEAR(by_matrix, by_quadrature, 1e-9 * by_quadrature);
}

TEST(GapCubics, AStraightCatheterDoesNotBend) {
  const GapCubics cubics({8, 94, 174, 274});
  Eigen::Matrix3Xd nodes(3, 8);
  for (int i = 0; i < 4; ++i) {
    nodes.col(2 * i) = Eigen::Vector3d(1, 2, 3) * cubics.node_s_mm(i);
    nodes.col(2 * i + 1) = Eigen::Vector3d(1, 2, 3);
  }
  EXPECT_NEAR((nodes * cubics.bending(280) * nodes.transpose()).trace(), 0, 1e-12);
}

}  // namespace
}  // namespace tubed
