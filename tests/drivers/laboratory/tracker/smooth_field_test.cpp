#include "drivers/laboratory/tracker/smooth_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tubed {
namespace {

const Eigen::AlignedBox3d kVolume(Eigen::Vector3d(-100, -100, -450), Eigen::Vector3d(100, 100, 60));

TEST(SmoothField, ReachesItsGreatestValueInTheVolumeAndNoMore) {
  const SmoothField field(5, 1, 4, kVolume);
  double max = 0;
  for (double x = -100; x <= 100; x += 10) {
    for (double y = -100; y <= 100; y += 10) {
      for (double z = -450; z <= 60; z += 10) max = std::max(max, field.at({x, y, z}).norm());
    }
  }
  EXPECT_NEAR(max, 4, 0.1);
}

TEST(SmoothField, ItsGradientIsThatOfFiniteDifferences) {
  const SmoothField field(5, 1, 4, kVolume);
  const Eigen::Vector3d p_mm(20, -60, -130);
  const Eigen::Matrix3d gradient = field.gradient(p_mm);
  constexpr double kStep_mm = 1e-3;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_mm = kStep_mm * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d slope = (field.at(p_mm + step_mm) - field.at(p_mm - step_mm)) / (2 * kStep_mm);
    EXPECT_TRUE(slope.isApprox(gradient.col(axis), 1e-6)) << axis;
  }
  EXPECT_GT(gradient.norm(), 1e-3);
}

TEST(SmoothField, IsNothingWhereNoneIsAskedFor) {
  EXPECT_EQ(SmoothField().at({1, 2, 3}), Eigen::Vector3d::Zero());
  EXPECT_EQ(SmoothField(5, 1, 0, kVolume).gradient({1, 2, 3}), Eigen::Matrix3d::Zero());
}

}  // namespace
}  // namespace tubed
