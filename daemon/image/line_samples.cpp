#include "daemon/image/line_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "daemon/image/sample_vesselness.hpp"

namespace tubed {

namespace {

constexpr double kRounding_px = 1e-3;  // more than single precision loses over a line

bool is_inside(const ImageMeasurement& image, const Eigen::Vector2d& p_px) {
  return p_px.x() >= 0 && p_px.y() >= 0 && p_px.x() < image.width - 1 - kRounding_px &&
         p_px.y() < image.height - 1 - kRounding_px;
}

Eigen::Vector2d held_inside(const ImageMeasurement& image, const Eigen::Vector2d& p_px) {
  return {std::clamp(p_px.x(), 0.0, image.width - 1.001), std::clamp(p_px.y(), 0.0, image.height - 1.001)};
}

// Counted from the pixel above and to the left of all points, so that no coordinate is below zero by more
// than rounding, and cutting off is rounding down.
void sample_inside(const float* map, std::ptrdiff_t width, const LinePoints& points,
                   const Eigen::Vector2d& last_px, std::span<float> to) {
  const Eigen::Array2d corner = points.first_px.cwiseMin(last_px).array().floor();
  const Eigen::Array2f first = (points.first_px.array() - corner).cast<float>();
  const Eigen::Array2f step = points.step_px.array().cast<float>();
  const float* from =
      map + static_cast<std::ptrdiff_t>(corner.y()) * width + static_cast<std::ptrdiff_t>(corner.x());
  for (std::size_t k = 0; k < to.size(); ++k) {
    const auto number = static_cast<float>(k);
    const float x_px = first.x() + number * step.x();
    const float y_px = first.y() + number * step.y();
    const auto left = static_cast<int>(x_px);
    const auto top = static_cast<int>(y_px);
    const float u = x_px - static_cast<float>(left);
    const float v = y_px - static_cast<float>(top);
    const float* p = from + top * width + left;
    const float above = p[0] + u * (p[1] - p[0]);
    const float below = p[width] + u * (p[width + 1] - p[width]);
    to[k] = above + v * (below - above);
  }
}

}  // namespace

void sample_line(const ImageMeasurement& image, const std::vector<float>& map, const LinePoints& points,
                 BeyondEdge beyond, std::span<float> to) {
  if (to.empty()) return;
  const Eigen::Vector2d last_px = points.first_px + static_cast<double>(to.size() - 1) * points.step_px;
  if (is_inside(image, points.first_px) && is_inside(image, last_px)) {
    sample_inside(map.data(), image.width, points, last_px, to);
    return;
  }
  for (std::size_t k = 0; k < to.size(); ++k) {
    const Eigen::Vector2d p_px = points.first_px + static_cast<double>(k) * points.step_px;
    to[k] = sample_map(image, map, beyond == BeyondEdge::kEdge ? held_inside(image, p_px) : p_px);
  }
}

}  // namespace tubed
