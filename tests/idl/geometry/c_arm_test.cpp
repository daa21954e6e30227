#include "idl/geometry/c_arm.hpp"
#include "idl/geometry/degree.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tubed {
namespace {

CArm c_arm_at(double primary_deg, double secondary_deg) {
  CArm c_arm;
  c_arm.source_detector_mm = 1200;
  c_arm.source_isocentre_mm = 785;
  c_arm.pixel_pitch_mm = 0.6;
  c_arm.primary_angle_deg = primary_deg;
  c_arm.secondary_angle_deg = secondary_deg;
  return c_arm;
}

/// Where the source stands and where the axes of the image point, in frame c_arm.
Eigen::Vector3d source_mm(const CArm& c_arm) { return pose_of(c_arm).inverse().translation(); }
Eigen::Vector3d image_axis(const CArm& c_arm, int axis) { return pose_of(c_arm).linear().row(axis); }

/// The same from another side: a frontal C-arm, its source below a patient on his back, is turned as its
/// gantry turns. First the arm slides in its holder (secondary angle), about the axis from the patient's
/// right to his left, so that the detector goes toward the head; then the holder turns about the axis from
/// feet to head (primary angle), so that the detector goes toward the patient's left.
RigidTransform T_c_arm_camera_by_turning(const CArm& c_arm) {
  RigidTransform frontal = RigidTransform::Identity();
  frontal.linear().col(0) = -Eigen::Vector3d::UnitX();  // image right: the patient's right
  frontal.linear().col(1) = -Eigen::Vector3d::UnitZ();  // image down: feet
  frontal.linear().col(2) = -Eigen::Vector3d::UnitY();  // the beam: from back to front
  frontal.translation() = c_arm.source_isocentre_mm * Eigen::Vector3d::UnitY();
  const Eigen::AngleAxisd cranial(c_arm.secondary_angle_deg * kDegree, -Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd left(c_arm.primary_angle_deg * kDegree, Eigen::Vector3d::UnitZ());
  return left * cranial * frontal;
}

TEST(CArm, FrontalHasItsDetectorBeforeTheChestAndTheHeadUp) {
  const CArm frontal = c_arm_at(0, 0);
  EXPECT_TRUE(source_mm(frontal).isApprox(Eigen::Vector3d(0, 785, 0), 1e-12));  // y: the patient's back
  EXPECT_TRUE(image_axis(frontal, 1).isApprox(Eigen::Vector3d(0, 0, -1)));      // down: feet
  EXPECT_TRUE(image_axis(frontal, 0).isApprox(Eigen::Vector3d(-1, 0, 0)));      // right: the patient's right
}

TEST(CArm, Lao90HasItsDetectorAtThePatientsLeft) {
  const CArm lao = c_arm_at(90, 0);
  EXPECT_TRUE(source_mm(lao).isApprox(Eigen::Vector3d(-785, 0, 0), 1e-12));
  EXPECT_LT((image_axis(lao, 2) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((image_axis(lao, 1) - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12);
}

TEST(CArm, Rao30HasItsDetectorTowardThePatientsRight) {
  const Eigen::Vector3d beam = image_axis(c_arm_at(-30, 0), 2);
  EXPECT_LT((beam - Eigen::Vector3d(-0.5, -std::sqrt(3) / 2, 0)).norm(), 1e-12);
}

TEST(CArm, Cranial20HasItsDetectorTowardTheHead) {
  const Eigen::Vector3d beam = image_axis(c_arm_at(0, 20), 2);
  EXPECT_LT((beam - Eigen::Vector3d(0, -std::cos(20 * kDegree), std::sin(20 * kDegree))).norm(), 1e-12);
  EXPECT_LT(source_mm(c_arm_at(0, 20)).z(), 0);  // the source toward the feet
}

TEST(CArm, AnyAnglesAreThoseOfAGantryThatTurns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> primary(-180, 180);
  std::uniform_real_distribution<double> secondary(-90, 90);
  for (int i = 0; i < 200; ++i) {
    const CArm c_arm = c_arm_at(primary(random), secondary(random));
    const RigidTransform T = pose_of(c_arm);
    ASSERT_TRUE(T.isApprox(T_c_arm_camera_by_turning(c_arm).inverse(), 1e-12))
        << c_arm.primary_angle_deg << ' ' << c_arm.secondary_angle_deg;
    ASSERT_NEAR(T.linear().determinant(), 1, 1e-12);
    ASSERT_TRUE(T.translation().isApprox(Eigen::Vector3d(0, 0, 785), 1e-12));  // the isocentre in the middle
  }
}

TEST(CArm, ATableThatPansTowardTheHeadMovesThePatientUpInTheImage) {
  CArm c_arm = c_arm_at(0, 0);
  CameraCalibration camera;
  camera.cx = 200;
  camera.cy = 300;
  place(c_arm, camera);
  const Eigen::Vector2d before_px = Camera(camera).project({0, 0, 0})->p_image_px;
  c_arm.table_mm = {0, 0, 30};
  place(c_arm, camera);
  const Eigen::Vector2d after_px = Camera(camera).project({0, 0, 0})->p_image_px;
  EXPECT_NEAR(before_px.y() - after_px.y(), 30 * (1200 / 0.6) / 785, 1e-9);
  EXPECT_NEAR(before_px.x(), after_px.x(), 1e-9);
}

TEST(CArm, FocalLengthIsTheDetectorsDistanceInPixelsTimesZoom) {
  CArm c_arm = c_arm_at(30, 10);
  c_arm.zoom = 1.5;
  CameraCalibration camera;
  camera.cx = 7;
  place(c_arm, camera);
  EXPECT_DOUBLE_EQ(camera.fx, 1.5 * 1200 / 0.6);
  EXPECT_EQ(camera.fx, camera.fy);
  EXPECT_EQ(camera.cx, 7);
}

TEST(CArm, AWorldOfItsOwnIsTakenToTheIsocentre) {
  CArm c_arm = c_arm_at(-40, 15);
  const RigidTransform T_c_arm_world =
      Eigen::Translation3d(10, -20, 300) * Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 0, 2).normalized());
  const RigidTransform without = pose_of(c_arm);
  c_arm.T_c_arm_world = T_c_arm_world;
  EXPECT_TRUE(pose_of(c_arm).isApprox(without * T_c_arm_world, 1e-12));
}

}  // namespace
}  // namespace tubed
