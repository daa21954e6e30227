// Radiographs of a phantom by a simulated C-arm, with the truth: to try a calibration, and to test it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/ball_phantom.hpp"
#include "clients/calibration/c_arm_fit.hpp"
#include "drivers/laboratory/fluoroscope/ball_radiograph.hpp"

namespace tubed {

/// A C-arm before a phantom.
struct SimulatedCArm {
  CArm c_arm;                          ///< its angles are not used
  std::vector<GantryAngles> angles;    ///< an image each
  int width = 512;                     ///< px
  int height = 512;                    ///< px
  double cx = 0, cy = 0;               ///< px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3
  bool mirrored = false;
  BallExposure exposure;
  /// Instead of the C-arm, the size and the principal point: this camera on a C-arm that stands at 0, 0 where
  /// the camera is, with its isocentre where that looks at.
  std::optional<CameraCalibration> camera{};
};

/// A flat panel of 512 x 512 pixels of 0.6 mm, 1200 mm from the source, isocentre at 785 mm, principal point
/// (257.3, 253.9), and the world turned and shifted against it; six directions; 1000 quanta a pixel.
SimulatedCArm usual_c_arm();

/// Exposures of a camera that stands somewhere: from where it is, and from other angles of a C-arm that has
/// it there at 0, 0. The detector is half as far behind what it looks at as the source is before that. Throws
/// PhantomError when the camera does not look toward the world's origin.
SimulatedCArm c_arm_of(const CameraCalibration& camera);

/// The built-in phantom in the middle of what `camera` looks at.
BallPhantom phantom_before(const CameraCalibration& camera);

/// The camera at one of its directions.
CameraCalibration camera_at(const SimulatedCArm& simulated, std::size_t image);

/// The image of that direction.
CalibrationPicture picture_at(const SimulatedCArm& simulated, const BallPhantom& phantom, std::size_t image);

/// Writes phantom.toml, image-1.png ..., truth.toml (cameras as a configuration has them) and angles.txt into
/// `folder`, which is made. Returns the names of the images. Throws PhantomError.
std::vector<std::filesystem::path> write_simulated_phantom(const SimulatedCArm& simulated,
                                                           const BallPhantom& phantom,
                                                           const std::filesystem::path& folder);

}  // namespace tubed
