// Maps of an image between its pixels.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// Bilinear; 0 outside the image and for places that are no numbers.
inline float sample_map(const ImageMeasurement& image, const std::vector<float>& map,
                        const Eigen::Vector2d& p_px) {
  const double x_px = p_px.x();
  const double y_px = p_px.y();
  if (!(x_px >= 0 && y_px >= 0 && x_px < image.width - 1 && y_px < image.height - 1)) {
    return 0;
  }
  const auto left = static_cast<int>(x_px);
  const auto top = static_cast<int>(y_px);
  const auto u = static_cast<float>(x_px - left);
  const auto v = static_cast<float>(y_px - top);
  const float* p = map.data() + static_cast<std::ptrdiff_t>(top) * image.width + left;
  return (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[image.width] + u * p[image.width + 1]);
}

inline float sample_vesselness(const ImageMeasurement& image, const Eigen::Vector2d& p_px) {
  return sample_map(image, image.vesselness, p_px);
}

}  // namespace tubed
