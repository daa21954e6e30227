// Radiographs of a phantom of balls: what a camera is calibrated with, exposed as the simulated fluoroscope
// exposes a patient.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Attenuation of steel at the effective energy of DetectorSettings: iron, 0.12 mm^2/mg at 65 keV (NIST
/// XCOM) times 7.8 mg/mm^3.
inline constexpr double kSteelAttenuation_per_mm = 0.8;

/// Balls in the world frame, and the plastic that holds them.
struct BallScene {
  Eigen::Matrix3Xd balls_world_mm;  ///< 3 x n, centres
  Eigen::VectorXd radius_mm;        ///< n
  double ball_attenuation_per_mm = kSteelAttenuation_per_mm;
  /// Line integral of the plastic in the middle of the picture; it falls by a fifth to the picture's corners
  /// and by a tenth from left to right.
  double body_attenuation = 0.5;
};

/// From detected quanta to grey values, without any processing for a display.
struct BallExposure {
  DetectorSettings detector;  ///< `lag` and scatter's width are not used: one exposure, even scatter
  int bits = 16;              ///< 8 or 16
  double open_beam = 0.8;     ///< share of full scale that the beam without phantom has; above 1: overexposed
  bool inverted = false;      ///< dense is bright
  std::int64_t seed = 1;
};

/// One radiograph, row by row, 8 bit or 16 bit in host order: the chord through each ball along 9 x 9 rays a
/// pixel where balls are, Beer-Lambert, blur, quanta and electronic noise as README.md has them. Dense is
/// dark. Lens distortion is the camera's, `mirrored` too. Throws std::invalid_argument for a camera without
/// pixels.
std::vector<std::uint8_t> ball_radiograph(const CameraCalibration& camera, const BallScene& scene,
                                          const BallExposure& exposure);

}  // namespace tubed
