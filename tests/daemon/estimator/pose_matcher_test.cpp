#include "daemon/estimator/view/pose_matcher.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace tubed {
namespace {

TEST(OwnPart, OfAPointIsWhatIsLeftAlongEachAxisAndAFifthAtLeast) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const auto along = [&](double x, double y, double z) -> Eigen::Matrix3d {
    return R * Eigen::Vector3d(x, y, z).asDiagonal() * R.transpose();
  };
  EXPECT_TRUE(own_part(along(9, 5, 4.5), 4).isApprox(along(5, 1, 0.9), 1e-9));
  EXPECT_TRUE(own_part(along(9, 5, 0.1), 0).isApprox(along(9, 5, 0.1), 1e-9));
}

}  // namespace
}  // namespace tubed
