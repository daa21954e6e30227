#include "idl/geometry/c_arm.hpp"

#include <cmath>

#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

/// Rows: the camera's x, y and z axes in frame c_arm.
Eigen::Matrix3d R_camera_c_arm(double primary_rad, double secondary_rad) {
  const double sin_p = std::sin(primary_rad);
  const double cos_p = std::cos(primary_rad);
  const double sin_s = std::sin(secondary_rad);
  const double cos_s = std::cos(secondary_rad);
  Eigen::Matrix3d R;
  R << -cos_p, -sin_p, 0,                     // x right: to the patient's right at P = 0
      sin_p * sin_s, -cos_p * sin_s, -cos_s,  // y down: -dd/dS, to the feet at S = 0
      sin_p * cos_s, -cos_p * cos_s, sin_s;   // z forward: d, from the source to the detector
  return R;
}

}  // namespace

RigidTransform pose_of(const CArm& c_arm) {
  RigidTransform T_camera_c_arm = RigidTransform::Identity();
  T_camera_c_arm.linear() =
      R_camera_c_arm(c_arm.primary_angle_deg * kDegree, c_arm.secondary_angle_deg * kDegree);
  T_camera_c_arm.translation() = Eigen::Vector3d(0, 0, c_arm.source_isocentre_mm);
  const Eigen::Translation3d table(c_arm.table_mm[0], c_arm.table_mm[1], c_arm.table_mm[2]);
  return T_camera_c_arm * table * c_arm.T_c_arm_world;
}

void place(const CArm& c_arm, CameraCalibration& camera) {
  camera.fx = camera.fy = c_arm.source_detector_mm * c_arm.zoom / c_arm.pixel_pitch_mm;
  camera.T_camera_world = pose_of(c_arm);
  camera.source_isocentre_mm = c_arm.source_isocentre_mm;
  camera.source_detector_mm = c_arm.source_detector_mm;
}

}  // namespace tubed
