#include "clients/cpp/centreline.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>

namespace tubed {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Vector3 kNoVector{kNan, kNan, kNan};

/// Where s lies in the spline: the first of its four coefficients and the place 0 .. 1 in their segment.
struct Place {
  std::size_t first;
  double t;
};

double clamped(const tubed_TubeEstimate& estimate, double s_mm) {
  return std::clamp(s_mm, 0.0, static_cast<double>(estimate.length_mm));
}

Place place_of(const tubed_TubeEstimate& estimate, double s_mm) {
  const double segments_from_tip =
      clamped(estimate, s_mm) / static_cast<double>(estimate.coefficient_spacing_mm);
  const double last_segment = estimate.coefficient_count - 4.0;
  const double segment = std::min(std::floor(segments_from_tip), last_segment);
  return {.first = static_cast<std::size_t>(segment), .t = segments_from_tip - segment};
}

Vector3 combine(const tubed_TubeEstimate& estimate, std::size_t first, const std::array<double, 4>& weights) {
  Vector3 sum{};
  for (std::size_t k = 0; k < weights.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sum[axis] += weights[k] * estimate.coefficients_mm[first + k][axis];
    }
  }
  return sum;
}

double variance_mm2(const tubed_CentrelinePoint& point) {
  const float* covariance = point.covariance_mm2;  // xx xy xz yy yz zz
  return (static_cast<double>(covariance[0]) + covariance[3] + covariance[5]) / 3;
}

}  // namespace

bool has_shape(const tubed_TubeEstimate& estimate) {
  return estimate.coefficient_count >= 4 &&
         estimate.coefficient_count <= std::size(estimate.coefficients_mm) && estimate.point_count >= 2 &&
         estimate.point_count <= std::size(estimate.points) && estimate.coefficient_spacing_mm > 0 &&
         std::isfinite(estimate.coefficient_spacing_mm) && estimate.length_mm > 0 &&
         std::isfinite(estimate.length_mm);
}

Vector3 point_at(const tubed_TubeEstimate& estimate, double s_mm) {
  if (!has_shape(estimate) || std::isnan(s_mm)) {
    return kNoVector;
  }
  const auto [first, t] = place_of(estimate, s_mm);
  const double u = 1 - t;
  // The uniform cubic B-spline's basis, Eq. (2).
  return combine(estimate, first,
                 {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                  (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6});
}

Vector3 tangent_at(const tubed_TubeEstimate& estimate, double s_mm) {
  if (!has_shape(estimate) || std::isnan(s_mm)) {
    return kNoVector;
  }
  const auto [first, t] = place_of(estimate, s_mm);
  const double u = 1 - t;
  Vector3 along = combine(estimate, first,
                          {-u * u / 2, (3 * t * t - 4 * t) / 2, (-3 * t * t + 2 * t + 1) / 2, t * t / 2});
  const double length = std::hypot(along[0], along[1], along[2]);
  for (double& component : along) {
    component /= -length;  // s grows away from the tip
  }
  return along;
}

double sigma_mm_at(const tubed_TubeEstimate& estimate, double s_mm) {
  if (!has_shape(estimate) || std::isnan(s_mm)) {
    return kNan;
  }
  const double last = estimate.point_count - 1.0;
  const double place = clamped(estimate, s_mm) / static_cast<double>(estimate.length_mm) * last;
  const double before = std::min(std::floor(place), last - 1);
  const auto i = static_cast<std::size_t>(before);
  const double share = place - before;
  return std::sqrt((1 - share) * variance_mm2(estimate.points[i]) +
                   share * variance_mm2(estimate.points[i + 1]));
}

std::uint32_t held_by_at(const tubed_TubeEstimate& estimate, double s_mm) {
  if (!has_shape(estimate) || std::isnan(s_mm)) {
    return 0;
  }
  const double place = clamped(estimate, s_mm) / static_cast<double>(estimate.length_mm);
  return estimate.points[static_cast<std::size_t>(std::lround(place * (estimate.point_count - 1.0)))].held_by;
}

double unheld_ratio(const tubed_TubeEstimate& estimate) {
  if (!has_shape(estimate)) {
    return 1;
  }
  const auto unheld = std::count_if(std::begin(estimate.points),
                                    std::begin(estimate.points) + static_cast<int>(estimate.point_count),
                                    [](const tubed_CentrelinePoint& point) { return point.held_by == 0; });
  return static_cast<double>(unheld) / estimate.point_count;
}

}  // namespace tubed
