#include "bench/support/value_axis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace tubed {

double round_step(double range) {
  const double raw = range / 5;
  const double power = std::pow(10, std::floor(std::log10(std::max(raw, 1e-12))));
  const double digits = raw / power;
  return power * (digits <= 1 ? 1 : digits <= 2 ? 2 : digits <= 5 ? 5 : 10);
}

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

void ValueAxis::draw(Svg& svg, const std::string& label) const {
  const double step = round_step(top);
  for (double value = 0; value <= top * 1.0001; value += step) {
    svg.line({left, y(value)}, {right, y(value)}, {value == 0 ? "#555" : "#ddd"});
    svg.text({left - 6, y(value) + 4}, short_number(value), 11, TextAnchor::kEnd);
  }
  svg.text({left - 6, bottom - height - 10}, label, 11, TextAnchor::kStart);
}

}  // namespace tubed
