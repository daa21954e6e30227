// The centreline at any arc length s, from the B-spline coefficients of a sample. s = 0 is the tip; mm, frame
// "world".
#pragma once

#include <array>
#include <cstdint>

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

/// What holds the tube at s_mm, clamped to [0, length_mm]: tubed_HELD_BY_COIL, tubed_HELD_BY_IMAGE, both or
/// 0, as the nearest of the points says. Where it is 0 nothing measured says where the tube is, only that it
/// is stiff: draw it so that it is not taken for the rest. 0 when !has_shape(estimate).
std::uint32_t held_by_at(const tubed_TubeEstimate& estimate, double s_mm);

/// Share of the points that nothing holds, 0 .. 1; 1 when !has_shape(estimate).
double unheld_ratio(const tubed_TubeEstimate& estimate);

}  // namespace tubed
