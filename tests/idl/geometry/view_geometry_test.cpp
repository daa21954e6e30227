#include "idl/geometry/view_geometry.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "idl/geometry/camera.hpp"

namespace tubed {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// The camera of Sec. 3.1, turned so that nothing is zero by chance.
CameraCalibration configured() {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = 400;
  camera.height = 600;
  camera.fx = camera.fy = 2000;
  camera.cx = 200;
  camera.cy = 300;
  camera.T_camera_world =
      Eigen::Translation3d(15, -25, 1200) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized());
  return camera;
}

ViewGeometry changed(const std::function<void(ViewGeometry&)>& change) {
  ViewGeometry geometry = geometry_of(configured());
  change(geometry);
  return geometry;
}

TEST(ViewGeometry, OfACalibrationIsThatCalibrationAgain) {
  const CameraCalibration camera = configured();
  const ViewGeometry geometry = geometry_of(camera);
  EXPECT_EQ(refusal_of(geometry, camera), nullptr);
  EXPECT_TRUE(geometry.T_camera_world().isApprox(camera.T_camera_world, 1e-12));
  EXPECT_EQ(geometry.fx, camera.fx);
  EXPECT_EQ(geometry.cy, camera.cy);
  EXPECT_TRUE(geometry.sigma.is_zero());
}

TEST(ViewGeometry, ACameraLooksFromItAndBackFromWhereItWasBuilt) {
  Camera camera(configured());
  const Eigen::Vector3d p_world_mm(20, -30, 40);
  const Eigen::Vector2d before_px = camera.project(p_world_mm)->p_image_px;
  const ViewGeometry moved = changed([](ViewGeometry& g) {
    g.t_camera_world_mm[0] += 12;
    g.fx = g.fy = 2500;
  });
  camera.look_from(moved);
  const Eigen::Vector3d p_camera_mm = moved.T_camera_world() * p_world_mm;
  EXPECT_NEAR(camera.project(p_world_mm)->p_image_px.x(), 2500 * p_camera_mm.x() / p_camera_mm.z() + 200,
              1e-9);
  camera.look_from(std::nullopt);
  EXPECT_EQ(camera.project(p_world_mm)->p_image_px, before_px);  // to the last bit
}

TEST(ViewGeometry, WhatCannotBeIsRefusedWithWords) {
  const struct {
    std::function<void(ViewGeometry&)> change;
    const char* words;
  } cases[] = {
      {[](ViewGeometry& g) { g.t_camera_world_mm[2] = kNan; }, "not finite"},
      {[](ViewGeometry& g) { g.q_camera_world[1] = std::numeric_limits<double>::infinity(); }, "not finite"},
      {[](ViewGeometry& g) { g.sigma.pivot_depth_mm = kNan; }, "not finite"},
      {[](ViewGeometry& g) { g.fx = 0; }, "focal lengths"},
      {[](ViewGeometry& g) { g.fy = -2000; }, "focal lengths"},
      {[](ViewGeometry& g) { g.cx = 2e4; }, "principal point"},
      {[](ViewGeometry& g) { g.q_camera_world = {}; }, "no rotation"},
      {[](ViewGeometry& g) {
         g.q_camera_world = {1, 1, 0, 0};
       },
       "no rotation"},
      {[](ViewGeometry& g) { g.t_camera_world_mm[0] = 1e6; }, "translation"},
      {[](ViewGeometry& g) { g.sigma.rotation_rad[2] = -0.01; }, "standard deviations"},
      {[](ViewGeometry& g) { g.sigma.translation_mm[0] = 5000; }, "standard deviations"},
      {[](ViewGeometry& g) { g.t_camera_world_mm[2] = -1200; }, "behind the camera"},
      {[](ViewGeometry& g) {
         g.t_camera_world_mm = {0.015, -0.025, 1.2};
       },
       "expected mm"},
      {[](ViewGeometry& g) { g.t_camera_world_mm[2] = 6000; }, "four times"},
  };
  for (const auto& one : cases) {
    const char* const words = refusal_of(changed(one.change), configured());
    ASSERT_NE(words, nullptr) << one.words;
    EXPECT_NE(std::string(words).find(one.words), std::string::npos) << words;
  }
}

TEST(ViewGeometry, AnInvertedPoseIsRefused) {
  CameraCalibration inverted = configured();
  inverted.T_camera_world = inverted.T_camera_world.inverse();
  const char* const words = refusal_of(geometry_of(inverted), configured());
  ASSERT_NE(words, nullptr);
  EXPECT_NE(std::string(words).find("not the inverse"), std::string::npos) << words;
}

TEST(ViewGeometry, WhatLiesBehindTheDetectorOfAKnownCArmIsRefused) {
  CameraCalibration c_arm = configured();
  c_arm.source_isocentre_mm = 785;
  c_arm.source_detector_mm = 1200;
  c_arm.T_camera_world.translation().z() = 785;
  ViewGeometry geometry = geometry_of(c_arm);
  EXPECT_EQ(refusal_of(geometry, c_arm), nullptr);
  geometry.t_camera_world_mm[2] = 1250;
  const char* const words = refusal_of(geometry, c_arm);
  ASSERT_NE(words, nullptr);
  EXPECT_NE(std::string(words).find("behind the detector"), std::string::npos) << words;
}

// A C-arm turned right round its isocentre and a table moved by half a metre are no mistakes.
TEST(ViewGeometry, FarMovesAreNotRefused) {
  for (const double angle_rad : {-1.5, 0.5, 3.0}) {
    CameraCalibration moved = configured();
    const Eigen::Translation3d pivot(0, 0, 1200);
    moved.T_camera_world = pivot * Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()) * pivot.inverse() *
                           Eigen::Translation3d(0, 500, -100) * moved.T_camera_world;
    EXPECT_EQ(refusal_of(geometry_of(moved), configured()), nullptr) << angle_rad;
  }
}

}  // namespace
}  // namespace tubed
