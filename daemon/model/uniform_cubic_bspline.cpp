#include "daemon/model/uniform_cubic_bspline.hpp"

#include <algorithm>
#include <cmath>

#include "idl/geometry/precondition.hpp"

namespace tubed {

UniformCubicBSpline::UniformCubicBSpline(int coefficient_count, double length_mm)
    : coefficient_count_(coefficient_count),
      length_mm_(length_mm),
      spacing_mm_(length_mm / (coefficient_count - 3)) {
  require(coefficient_count >= 4, "a cubic B-spline needs at least 4 coefficients");
  require(length_mm > 0 && std::isfinite(length_mm), "a cubic B-spline needs a positive, finite length");
}

CubicBasis UniformCubicBSpline::basis(double s_mm) const {
  const double segments_from_tip = s_mm / spacing_mm_;
  const double last_segment = coefficient_count_ - 4;
  // Written so that NaN ends in segment 0 (with NaN weights): a conversion of NaN to int would be undefined.
  const double segment = std::max(0.0, std::min(std::floor(segments_from_tip), last_segment));
  const double t = segments_from_tip - segment;

  // The rows of Eq. (2), and their first and second derivative with respect to t.
  const double u = 1 - t;
  const double t2 = t * t;
  const double per_mm = 1 / spacing_mm_;
  const double per_mm2 = per_mm * per_mm;
  CubicBasis basis;
  basis.first = static_cast<int>(segment);
  basis.value = {u * u * u / 6, (3 * t2 * t - 6 * t2 + 4) / 6, (-3 * t2 * t + 3 * t2 + 3 * t + 1) / 6,
                 t2 * t / 6};
  basis.first_derivative = {-u * u / 2 * per_mm, (3 * t2 - 4 * t) / 2 * per_mm,
                            (-3 * t2 + 2 * t + 1) / 2 * per_mm, t2 / 2 * per_mm};
  basis.second_derivative = {u * per_mm2, (3 * t - 2) * per_mm2, (1 - 3 * t) * per_mm2, t * per_mm2};
  return basis;
}

}  // namespace tubed
