// Rectangles of a camera's images that show no X-rays: burnt-in text, a logo, an ECG trace.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "idl/geometry/camera.hpp"

namespace tubed {

/// Pixels with x <= column < x + width, y <= row < y + height.
struct ImageMask {
  int x = 0, y = 0, width = 0, height = 0;

  [[nodiscard]] bool contains(int column, int row) const {
    return column >= x && column < x + width && row >= y && row < y + height;
  }
  bool operator==(const ImageMask&) const = default;
};

/// What camera.masks says, in pixels of the images as they come; what reaches beyond an image is cut off.
std::vector<ImageMask> masks_of(const CameraCalibration& camera);

/// Why `masks`, as CameraCalibration::masks has them, cannot be those of images of that size; empty: they
/// can.
std::string fault_of_masks(const std::vector<int>& masks, int width, int height);

/// Does the pixel nearest to `p_image_px`, in coordinates of `camera` (after `mirrored`), lie in a mask?
/// Never allocates; never true for NaN.
bool is_masked(const CameraCalibration& camera, const Eigen::Vector2d& p_image_px);

/// The masks of images of which squares of `binning` pixels a side become one: each pixel that a masked one
/// is part of. `camera`: before binning.
std::vector<int> binned_masks(const CameraCalibration& camera, int binning);

}  // namespace tubed
