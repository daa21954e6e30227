// Volumes small enough for unit tests, and a view of them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "drivers/laboratory/fluoroscope/c_arm.hpp"
#include "drivers/laboratory/fluoroscope/radiograph.hpp"

namespace tubed {

/// A cube of `size` voxels of `spacing_mm`, centred at the origin, all of one attenuation, within a border of
/// air.
inline AttenuationVolume cube_of(int size, double spacing_mm, float attenuation_per_mm, int air = 0) {
  RigidTransform T_room_volume = RigidTransform::Identity();
  T_room_volume.translation().setConstant(-(size - 1) * spacing_mm / 2);
  AttenuationVolume volume(Eigen::Vector3i::Constant(size), Eigen::Vector3d::Constant(spacing_mm),
                           T_room_volume);
  for (int k = air; k < size - air; ++k) {
    for (int j = air; j < size - air; ++j) {
      for (int i = air; i < size - air; ++i) {
        volume.set(i, j, k, attenuation_per_mm);
      }
    }
  }
  return volume;
}

/// 200 mm of soft tissue that fills the picture.
inline AttenuationVolume water_patient() { return cube_of(51, 10, 0.0205F * 0.4F); }

/// The camera of Sec. 3.1 cut down to 120 x 100 pixels, in front of the origin.
inline CameraCalibration small_view(const char* name = "A", double lao_deg = 0) {
  CameraCalibration camera = c_arm_view(name, {lao_deg, 0}, Eigen::Vector3d::Zero());
  camera.width = 120;
  camera.height = 100;
  camera.cx = 60;
  camera.cy = 50;
  return camera;
}

/// Noise and lag off: what is left is geometry and physics.
inline RadiographSettings without_noise() {
  RadiographSettings settings;
  settings.detector.quanta_per_pixel = INFINITY;
  settings.detector.electronic_noise = 0;
  settings.detector.lag = 0;
  settings.display.bits = 16;
  return settings;
}

/// A gentle arc about the origin that crosses the picture from top to bottom, tip first, points every 1 mm.
inline RadiographRod bent_catheter(double shift_mm = 0) {
  RadiographRod rod;
  rod.centreline_room_mm.resize(3, 121);
  constexpr double kRadius_mm = 60;
  for (Eigen::Index i = 0; i < 121; ++i) {
    const double angle = (static_cast<double>(i) - 60) / kRadius_mm;
    rod.centreline_room_mm.col(i) = Eigen::Vector3d(kRadius_mm * (1 - std::cos(angle)) - 8 + shift_mm,
                                                    10 * std::sin(2 * angle), kRadius_mm * std::sin(angle));
  }
  return rod;
}

inline std::vector<std::uint8_t> picture_of(Radiograph& radiograph, const RadiographScene& scene) {
  std::vector<std::uint8_t> pixels(radiograph.bytes_per_image());
  radiograph.render(scene, pixels);
  return pixels;
}

}  // namespace tubed
