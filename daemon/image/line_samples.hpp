// A map of an image at equal steps along a straight line.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// first_px, first_px + step_px, ... of an image.
struct LinePoints {
  Eigen::Vector2d first_px;
  Eigen::Vector2d step_px;
};

/// What is read beyond an image's edge.
enum class BeyondEdge {
  kNothing,  ///< 0
  kEdge      ///< what the nearest place inside has
};

/// Fills `to` with the map at as many points, between pixels as sample_map() has it, to rounding: points of
/// single precision relative to the first one. 0 at places that are no numbers. A line that lies inside is
/// read without asking so at each point.
void sample_line(const ImageMeasurement& image, const std::vector<float>& map, const LinePoints& points,
                 BeyondEdge beyond, std::span<float> to);

}  // namespace tubed
