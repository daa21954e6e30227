// How often something may be done, whatever somebody else would have done.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tubed {

/// One permit every `period_ns`; of those not used `burst` are kept. One thread, which brings the time.
class Allowance {
 public:
  Allowance(std::int64_t period_ns, std::int64_t burst) : period_ns_(period_ns), burst_(burst) {}

  /// False when there is none left at `now_ns` (CLOCK_MONOTONIC).
  bool take(std::int64_t now_ns) noexcept {
    const std::int64_t from_ns = std::max(used_until_ns_, now_ns - burst_ * period_ns_);
    if (from_ns + period_ns_ > now_ns) {
      return false;
    }
    used_until_ns_ = from_ns + period_ns_;
    return true;
  }

 private:
  std::int64_t period_ns_;
  std::int64_t burst_;
  std::int64_t used_until_ns_ = 0;  ///< what was taken has used up the time until here
};

}  // namespace tubed
