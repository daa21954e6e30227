// Which rest curves a configuration takes.
#pragma once

#include <numbers>

#include "drivers/interface/rest_curve.hpp"

namespace tubed {

inline constexpr double kMinRestArc_mm = 0.5;   ///< of an arc's length
inline constexpr double kMinRestRadius_mm = 2;  ///< and half of the catheter's diameter
inline constexpr double kMaxRestTurns = 2;      ///< of all arcs together

/// Absolute turns of all arcs, in whole circles.
inline double whole_turns(const RestCurve& curve) { return curve.whole_turn_rad() / (2 * std::numbers::pi); }

}  // namespace tubed
