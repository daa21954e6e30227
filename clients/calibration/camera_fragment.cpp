#include <cmath>

#include "clients/calibration/camera_calibration.hpp"
#include "clients/calibration/camera_words.hpp"

namespace tubed {

namespace {

std::vector<double> rounded(const std::array<double, 3>& values, double scale) {
  std::vector<double> list;
  for (const double value : values) list.push_back(std::round(value * scale) / scale);
  return list;
}

double rounded(double value, double scale) { return std::round(value * scale) / scale; }

void add_c_arm(const CArm& c_arm, const std::string& camera, ConfigurationFragment& fragment) {
  const std::string table = camera + ".c_arm.";
  fragment.values.push_back({table + "source_detector_mm", rounded(c_arm.source_detector_mm, 1e3)});
  fragment.values.push_back({table + "source_isocentre_mm", rounded(c_arm.source_isocentre_mm, 1e3)});
  fragment.values.push_back({table + "pixel_pitch_mm", c_arm.pixel_pitch_mm});
  fragment.values.push_back({table + "primary_angle_deg", c_arm.primary_angle_deg});
  fragment.values.push_back({table + "secondary_angle_deg", c_arm.secondary_angle_deg});
  fragment.values.push_back({table + "T_c_arm_world", Eigen::Matrix4d(c_arm.T_c_arm_world.matrix())});
}

}  // namespace

ConfigurationFragment fragment_of(const CameraFindings& findings) {
  const CameraCalibration camera = findings.calibration();
  ConfigurationFragment fragment;
  fragment.found_by = "tubectl calibrate camera, " + std::to_string(findings.images.size()) +
                      (findings.images.size() == 1 ? " image" : " images");
  fragment.date = date_of_today();
  for (const CameraStatement& statement : findings.statements) fragment.remarks.push_back(statement.words);
  const std::string table = "camera[" + camera.name + "]";
  if (findings.c_arm) {
    add_c_arm(findings.c_arm->c_arm, table, fragment);
  } else {
    fragment.values.push_back({table + ".fx", rounded(camera.fx, 1e3)});
    fragment.values.push_back({table + ".fy", rounded(camera.fy, 1e3)});
    fragment.values.push_back({table + ".T_camera_world", Eigen::Matrix4d(camera.T_camera_world.matrix())});
  }
  fragment.values.push_back({table + ".cx", rounded(camera.cx, 1e3)});
  fragment.values.push_back({table + ".cy", rounded(camera.cy, 1e3)});
  fragment.values.push_back(
      {table + ".distortion", std::vector<double>(camera.distortion.begin(), camera.distortion.end())});
  if (findings.mirrored || findings.settings.mirrored) {
    fragment.values.push_back({table + ".mirrored", findings.mirrored});
  }
  fragment.values.push_back(
      {table + ".calibration_residual_px", rounded(*camera.calibration_residual_px, 1e3)});
  fragment.values.push_back({table + ".pose_sigma_mm", rounded(*camera.pose_sigma_mm, 1e4)});
  fragment.values.push_back({table + ".pose_sigma_deg", rounded(*camera.pose_sigma_deg, 1e5)});
  fragment.values.push_back({table + ".focal_sigma", rounded(*camera.focal_sigma, 1e7)});
  return fragment;
}

}  // namespace tubed
