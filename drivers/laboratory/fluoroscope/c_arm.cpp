#include "drivers/laboratory/fluoroscope/c_arm.hpp"

#include <cmath>
#include <numbers>

namespace tubed {

CameraCalibration c_arm_view(const std::string& name, const CArmAngles& angles,
                             const Eigen::Vector3d& target_room_mm) {
  constexpr double kDistance_mm = 1200;
  const double lao = angles.lao_deg * std::numbers::pi / 180;
  const double cranial = angles.cranial_deg * std::numbers::pi / 180;
  const Eigen::Vector3d to_camera(std::sin(lao) * std::cos(cranial), -std::cos(lao) * std::cos(cranial),
                                  std::sin(cranial));
  Eigen::Matrix3d R_camera_world;
  R_camera_world.row(0) = Eigen::Vector3d(std::cos(lao), std::sin(lao), 0);
  R_camera_world.row(2) = -to_camera;
  R_camera_world.row(1) =
      Eigen::Vector3d(R_camera_world.row(2)).cross(Eigen::Vector3d(R_camera_world.row(0)));

  CameraCalibration camera;
  camera.name = name;
  camera.width = 400;
  camera.height = 600;
  camera.fx = camera.fy = 2000;
  camera.cx = 200;
  camera.cy = 300;
  camera.T_camera_world.linear() = R_camera_world;
  camera.T_camera_world.translation() =
      -R_camera_world * target_room_mm + kDistance_mm * Eigen::Vector3d::UnitZ();
  return camera;
}

}  // namespace tubed
