// Maps of an image between its pixels.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// Bilinear; 0 outside the image and for places that are no numbers.
inline float sample_map(const ImageMeasurement& image, const std::vector<float>& map,
                        const Eigen::Vector2d& p_px) {
  const double left = std::floor(p_px.x());
  const double top = std::floor(p_px.y());
  if (!(left >= 0 && top >= 0 && left + 1 < image.width && top + 1 < image.height)) {
    return 0;
  }
  const auto u = static_cast<float>(p_px.x() - left);
  const auto v = static_cast<float>(p_px.y() - top);
  const float* p =
      map.data() + static_cast<std::ptrdiff_t>(top) * image.width + static_cast<std::ptrdiff_t>(left);
  return (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * p[image.width] + u * p[image.width + 1]);
}

inline float sample_vesselness(const ImageMeasurement& image, const Eigen::Vector2d& p_px) {
  return sample_map(image, image.vesselness, p_px);
}

}  // namespace tubed
