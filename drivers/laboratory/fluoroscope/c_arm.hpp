// Where a C-arm puts the camera.
#pragma once

#include <Eigen/Core>
#include <string>

#include "idl/geometry/camera.hpp"

namespace tubed {

/// A C-arm's angles in degrees: LAO (positive) or RAO (negative), cranial (positive) or caudal.
struct CArmAngles {
  double lao_deg = 0;
  double cranial_deg = 0;
};

/// The camera of Sec. 3.1: 400 x 600 px, f = 2000 px, principal point (200, 300), its centre 1200 mm from
/// `target_room_mm`, which projects to the principal point. Room frame: x toward the patient's left, y
/// posterior, z superior. The camera stands on the side from which the picture is looked at (AP: in front of
/// the patient, whose right is then on the picture's left); the head is up.
CameraCalibration c_arm_view(const std::string& name, const CArmAngles& angles,
                             const Eigen::Vector3d& target_room_mm);

}  // namespace tubed
