// Pinhole camera with OpenCV's distortion (k1 k2 p1 p2 k3). Camera frame: x right, y down, z along the view
// (depth); image: px, the centre of the first pixel is (0, 0).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "daemon/geometry/rigid_transform.hpp"

namespace tubed {

/// Calibration of one view, as configuration and sequence folders give it.
struct CameraCalibration {
  std::string name;
  int width = 0;                       ///< px
  int height = 0;                      ///< px
  double fx = 0, fy = 0;               ///< focal lengths, px
  double cx = 0, cy = 0;               ///< principal point, px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3, OpenCV's order
  RigidTransform T_camera_world = RigidTransform::Identity();
  double white_level = 0;  ///< grey value of a saturated pixel of its detector; 0: not known
};

/// A point in the image and how it moves with the point in the world.
struct Projection {
  Eigen::Vector2d p_image_px;
  Eigen::Matrix<double, 2, 3> J_image_world;  ///< px per mm
  double depth_mm;                            ///< z in the camera frame
};

/// Projects world points. Immutable after construction, callable from any thread, never allocates after it.
class Camera {
 public:
  explicit Camera(CameraCalibration calibration);

  /// pi of the paper: world to image with Jacobian; nothing for a point at or behind the camera's centre (or
  /// NaN). Far outside the field of view a distortion with negative k can fold points back into the image, as
  /// OpenCV's does.
  [[nodiscard]] std::optional<Projection> project(const Eigen::Vector3d& p_world_mm) const;

  /// Image point without distortion: the direction (x, y, 1) in the camera frame, by fixed-point iteration
  /// (to 1e-12, at most 100 rounds; the last value for a distortion that cannot be inverted there).
  [[nodiscard]] Eigen::Vector3d ray_camera(const Eigen::Vector2d& p_image_px) const;

  /// Inside the image by at least `margin_px` (negative: may be outside by as much)? The image reaches from
  /// the centre of its first pixel (0, 0) to that of its last (width - 1, height - 1): whatever is contained
  /// can be interpolated. Never true for NaN.
  [[nodiscard]] bool contains(const Eigen::Vector2d& p_image_px, double margin_px = 0) const;

  [[nodiscard]] const CameraCalibration& calibration() const { return calibration_; }

 private:
  CameraCalibration calibration_;
};

}  // namespace tubed
