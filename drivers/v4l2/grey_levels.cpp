#include "drivers/v4l2/grey_levels.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

// Limited range: with n bits black is 16 * 2^(n - 8) and white 235 * 2^(n - 8); what is outside is clipped.
// A screen shows value^gamma: that is linear in what the console meant.
void GreyLevels::set_bits(int bits) noexcept {
  const double max = static_cast<double>((1U << static_cast<unsigned>(bits)) - 1);
  const double step = static_cast<double>(1U << static_cast<unsigned>(bits - 8));
  const double black = coding_.is_limited ? 16 * step : 0;
  const double white = coding_.is_limited ? 235 * step : max;
  for (std::size_t value = 0; value <= static_cast<std::size_t>(max); ++value) {
    const double share = std::clamp((static_cast<double>(value) - black) / (white - black), 0.0, 1.0);
    table_[value] = static_cast<std::uint16_t>(std::lround(std::pow(share, coding_.gamma) * max));
  }
}

}  // namespace tubed
