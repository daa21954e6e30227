// How pictures draw what nothing holds: dashed.
#pragma once

#include <cmath>

#include "clients/cpp/centreline.hpp"

namespace tubed {

/// Whether a picture draws the tube at that distance from its tip: all of what a coil or an image holds, and
/// dashes of the rest.
inline bool is_drawn_at(const tubed_TubeEstimate& estimate, double s_mm) {
  constexpr double kDash_mm = 8;  // and the gap behind it
  return held_by_at(estimate, s_mm) != 0 || std::fmod(s_mm, kDash_mm) < kDash_mm / 2;
}

}  // namespace tubed
