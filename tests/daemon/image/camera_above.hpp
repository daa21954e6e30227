// A camera of plain numbers, for tests of lines across a tube.
#pragma once

#include "idl/geometry/camera.hpp"

namespace tubed {

/// Looks along z from 1000 mm: 2 px a mm, world (0, 0) at pixel (100, 150).
inline Camera camera_above() {
  CameraCalibration calibration;
  calibration.width = 200;
  calibration.height = 300;
  calibration.fx = calibration.fy = 2000;
  calibration.cx = 100;
  calibration.cy = 150;
  calibration.T_camera_world.translation().z() = 1000;
  return Camera(calibration);
}

}  // namespace tubed
