#include "drivers/aurora/rate_choice.hpp"

#include <algorithm>

namespace tubed::aurora {

BaudRate RateChoice::best() const noexcept {
  const int most = bits_per_second(wanted_);
  for (std::size_t i = 0; i < kRates.size(); ++i) {
    if (bits_per_second(kRates[i]) <= most && (refused_ >> i & 1U) == 0) {
      return kRates[i];
    }
  }
  return BaudRate::k9600;
}

void RateChoice::refuse(BaudRate rate) noexcept {
  const auto* const at = std::find(kRates.begin(), kRates.end(), rate);
  refused_ |= 1U << static_cast<std::size_t>(at - kRates.begin());
}

}  // namespace tubed::aurora
