// The ray of every pixel of a view.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "idl/geometry/camera.hpp"

namespace tubed {

/// Rays from the X-ray source (the camera's centre) through the centres of the pixels, lens distortion taken
/// out. Immutable after construction.
class PixelRays {
 public:
  /// Throws std::invalid_argument for a camera without pixels or focal length.
  explicit PixelRays(const CameraCalibration& calibration);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] std::size_t size() const { return slopes_.size(); }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const Eigen::Vector3d& source_room_mm() const { return source_room_mm_; }
  /// Not a unit vector: its depth is 1.
  [[nodiscard]] Eigen::Vector3d direction_room(std::size_t pixel) const {
    return R_room_camera_ * slopes_[pixel].cast<double>().homogeneous();
  }
  /// x / z and y / z in the camera frame of a place `offset_px` from the centre of `pixel`.
  [[nodiscard]] Eigen::Vector2d slope_camera(std::size_t pixel, const Eigen::Vector2d& offset_px) const {
    return slopes_[pixel].cast<double>() + offset_px.cwiseProduct(pixel_slope_);
  }

 private:
  Camera camera_;
  int width_;
  int height_;
  Eigen::Vector3d source_room_mm_;
  Eigen::Matrix3d R_room_camera_;
  Eigen::Vector2d pixel_slope_;          ///< of one pixel
  std::vector<Eigen::Vector2f> slopes_;  ///< row by row
};

}  // namespace tubed
