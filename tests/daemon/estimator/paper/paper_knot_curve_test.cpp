#include "daemon/estimator/paper/paper_knot_curve.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

TEST(KnotCurve, PassesItsKnotPoints) {
  const KnotCurve curve(20, 380);
  for (int i = 0; i < 20; ++i) {
    const Eigen::VectorXd weights = curve.weights(curve.knot_point_s_mm(i));
    EXPECT_NEAR(weights(i), 1, 1e-6) << i;
    EXPECT_NEAR(weights.cwiseAbs().sum(), 1, 1e-5) << i;
  }
}

TEST(KnotCurve, OnAStraightCatheterTheParameterIsArcLengthUpToTheClampedEnds) {
  const KnotCurve curve(20, 380);
  Eigen::RowVectorXd along(20);
  for (int i = 0; i < 20; ++i) along(i) = curve.knot_point_s_mm(i);
  for (double s = 0; s <= 380; s += 2.5) EXPECT_NEAR(along * curve.weights(s), s, 1e-6) << s;
}

TEST(KnotCurve, IsTheSplineOfTheKnotPoints) {
  const KnotCurve curve(20, 380);
  Eigen::Matrix3Xd K(3, 20);
  for (int i = 0; i < 20; ++i) K.col(i) = arc_point(curve.knot_point_s_mm(i));
  const KnotPointSpline spline(K);
  for (double s = 0; s <= 380; s += 10) {
    const Eigen::Vector3d p = K * curve.weights(s);
    double nearest = 1e9;
    for (double parameter = 0; parameter <= 21; parameter += 0.001) {
      nearest = std::min(nearest, (spline.point(parameter) - p).norm());
    }
    EXPECT_LT(nearest, 0.02) << s;
    EXPECT_LT((p - arc_point(s)).norm(), 0.3) << s;
  }
}

}  // namespace
}  // namespace tubed
