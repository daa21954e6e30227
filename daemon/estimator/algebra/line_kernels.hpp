// The inner loops of image lines as residuals, compiled for every instruction set and chosen when they are
// called.
#pragma once

#include <array>
#include <cstddef>

#include "idl/geometry/camera.hpp"

namespace tubed {

/// A camera as plain numbers.
struct LineCamera {
  explicit LineCamera(const CameraCalibration& calibration);

  std::array<double, 12> T_camera_world;  ///< rows of rotation and translation
  double fx, fy, cx, cy;
  std::array<double, 5> distortion;
};

/// `count` lines, each array with one value a line, readable up to kLineLanes - 1 further.
struct LineRows {
  std::size_t count = 0;
  const double* x_world_mm = nullptr;
  const double* y_world_mm = nullptr;
  const double* z_world_mm = nullptr;
  const double* normal_x = nullptr;  ///< over the standard deviation
  const double* normal_y = nullptr;
  const double* target = nullptr;  ///< normal . target_px
};

/// Where the results go; writable as far as LineRows are readable.
struct LineResults {
  double* residual = nullptr;    ///< normal . pi(p) - target
  double* gradient_x = nullptr;  ///< by p_world
  double* gradient_y = nullptr;
  double* gradient_z = nullptr;
};

inline constexpr std::size_t kLineLanes = 8;

/// Camera::project() of each point and what its line makes of it; residual and gradient are 0 for points at
/// or behind the camera's centre.
void project_to_lines(const LineCamera& camera, const LineRows& rows, const LineResults& results);

/// sums (8 x 10, column-major) += sum over rows of outer (8) times products (10, rows 12 apart).
void add_outer_products(const double* outer, const double* products, std::size_t count, double* sums);

}  // namespace tubed
