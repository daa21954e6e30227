#include "daemon/estimator/view/view_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "idl/geometry/camera.hpp"

namespace tubed {
namespace {

using Vector3 = Eigen::Vector3d;

constexpr double kPivot_mm = 1150;

ViewPose turned_pose() {
  CameraCalibration camera;
  camera.fx = camera.fy = 2000;
  camera.T_camera_world.translation() = Vector3(3, -4, 1200);
  camera.T_camera_world.linear() = Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  return {geometry_of(camera), kPivot_mm};
}

ViewPose::Error some_error() {
  ViewPose::Error e;
  e << 0.02, -0.03, 0.01, 4, -5, 6;
  return e;
}

TEST(ViewPose, AnErrorTurnsAboutThePivotAndShifts) {
  const ViewPose pose = turned_pose();
  const Vector3 p_world = pose.geometry().T_camera_world().inverse() * Vector3(0, 0, kPivot_mm);
  const Vector3 moved = pose.with_error(some_error()).geometry().T_camera_world() * p_world;
  EXPECT_NEAR((moved - Vector3(4, -5, 6 + kPivot_mm)).norm(), 0, 1e-9) << "the pivot itself is only shifted";
}

TEST(ViewPose, ItsJacobianIsThatOfSmallErrors) {
  const ViewPose pose = turned_pose();
  const Vector3 p_world(30, -20, 10);
  const Vector3 p_camera = pose.geometry().T_camera_world() * p_world;
  const ViewPose::Error e = 1e-6 * some_error();
  const Vector3 moved = pose.with_error(e).geometry().T_camera_world() * p_world;
  EXPECT_NEAR((moved - p_camera - pose.jacobian(p_camera) * e).norm(), 0, 1e-9);
}

// Of a shift in depth nothing is seen, of one across everything.
TEST(ViewPose, WhatItLeavesOpenIsAcrossTheRay) {
  ViewPose pose = turned_pose();
  ViewPose::Covariance P = ViewPose::Covariance::Zero();
  P(3, 3) = 4;
  P(5, 5) = 100;
  pose.set_covariance(P);
  const RigidTransform T = pose.geometry().T_camera_world();
  const Vector3 p_world = T.inverse() * Vector3(0, 0, 1180);
  const Eigen::Matrix3d in_camera = T.linear() * pose.covariance_across(p_world) * T.linear().transpose();
  EXPECT_NEAR(in_camera(0, 0), 4, 1e-9);
  EXPECT_NEAR(in_camera(2, 2), 0, 1e-9);
  EXPECT_NEAR(in_camera(1, 1), 0, 1e-9);
}

TEST(ViewPose, ItsGeometryStatesTheStandardDeviations) {
  ViewPose pose = turned_pose();
  EXPECT_TRUE(pose.geometry().sigma.is_zero());
  pose.add_sigma(0.01, 3);
  pose.add_sigma(0, 4);
  EXPECT_NEAR(pose.geometry().sigma.rotation_rad[1], 0.01, 1e-12);
  EXPECT_NEAR(pose.geometry().sigma.translation_mm[2], 5, 1e-12);
  EXPECT_EQ(pose.geometry().sigma.pivot_depth_mm, kPivot_mm);
}

}  // namespace
}  // namespace tubed
