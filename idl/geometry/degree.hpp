// Angles are in radians; people write degrees.
#pragma once

#include <numbers>

namespace tubed {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< rad

}  // namespace tubed
