#include "drivers/laboratory/fluoroscope/mock_up.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tubed {
namespace {

/// Straight up, 20 mm wide.
VesselCourse straight_vessel() {
  VesselCourse course{Eigen::Matrix3Xd::Zero(3, 101), Eigen::VectorXd::Constant(101, 10)};
  course.centreline_room_mm.row(2) = Eigen::RowVectorXd::LinSpaced(101, -50, 50);
  return course;
}

/// Attenuation at the voxel nearest to a point of the room, 1/mm.
float at(const AttenuationVolume& volume, const Eigen::Vector3d& p_room_mm) {
  const Eigen::Vector3i voxel =
      ((volume.T_room_volume().inverse() * p_room_mm).array() / volume.spacing_mm().array())
          .round()
          .cast<int>();
  return volume.at(voxel.x(), voxel.y(), voxel.z());
}

TEST(MockUp, IsSiliconeAroundWaterInAir) {
  const AttenuationVolume mock_up = make_mock_up(straight_vessel());
  EXPECT_NEAR(at(mock_up, {0, 0, 0}), 0.0201, 1e-4);
  EXPECT_NEAR(at(mock_up, {11.25, 0, 0}), 0.0240, 5e-4);
  EXPECT_EQ(at(mock_up, {14.5, 0, 0}), 0);
}

TEST(MockUp, ACourseWithoutPointsOrRadiiIsRefused) {
  EXPECT_THROW(make_mock_up({Eigen::Matrix3Xd(3, 0), Eigen::VectorXd(0)}), std::invalid_argument);
  EXPECT_THROW(make_mock_up({Eigen::Matrix3Xd::Zero(3, 5), Eigen::VectorXd::Ones(4)}), std::invalid_argument);
}

}  // namespace
}  // namespace tubed
