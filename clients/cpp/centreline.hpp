// The centreline at any arc length s, from the B-spline coefficients of a sample. s = 0 is the tip; mm, frame
// "world".
#pragma once

#include <array>

#include "TubeEstimate.h"

namespace tubed {

using Vector3 = std::array<double, 3>;

/// Whether the sample carries a spline and points that can be evaluated: counts within their arrays, at least
/// 4 coefficients with a positive finite spacing, at least 2 points, a positive finite length. It says
/// nothing about validity.
bool has_shape(const tubed_TubeEstimate& estimate);

/// Position at s_mm, clamped to [0, length_mm]. NaN when !has_shape(estimate).
Vector3 point_at(const tubed_TubeEstimate& estimate, double s_mm);

/// Unit vector toward the tip (against growing s) at s_mm, clamped to [0, length_mm]. NaN when
/// !has_shape(estimate).
Vector3 tangent_at(const tubed_TubeEstimate& estimate, double s_mm);

/// One standard deviation of the position at s_mm: the root mean square of those along the three axes, from
/// the covariances of the two neighbouring points, interpolated linearly. NaN when !has_shape(estimate).
double sigma_mm_at(const tubed_TubeEstimate& estimate, double s_mm);

}  // namespace tubed
