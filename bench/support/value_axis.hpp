// The vertical axis of a plot.
#pragma once

#include <string>

#include "clients/svg/svg.hpp"

namespace tubed {

/// A vertical axis from 0 to `top` on `height` px.
struct ValueAxis {
  double left = 0;    ///< px of the axis
  double right = 0;   ///< to where grid lines go
  double bottom = 0;  ///< px of 0
  double height = 0;
  double top = 1;  ///< value at the upper end
  [[nodiscard]] double y(double value) const { return bottom - height * value / top; }
  /// Grid lines with numbers at a round step, and the label above.
  void draw(Svg& svg, const std::string& label) const;
};

/// 1, 2, 5 or 10 times a power of ten: about five steps over `range`.
double round_step(double range);

/// As short as it can be read.
std::string short_number(double value);

}  // namespace tubed
