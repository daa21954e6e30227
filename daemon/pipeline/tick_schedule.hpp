// The 30 Hz rule: estimates with a new image leave at once, ticks fill the gaps, and a stall is never made up
// for by a burst.
#pragma once

#include <algorithm>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// A value of the optimizer thread. Every estimate, whatever its reason, pays for one slot of length
/// `period`; a tick is due `grace` after the start of a slot that nobody paid for. So images at any rate up
/// to 1/period are completed to exactly that rate. Faster ones are thinned out before: ImageRateLimit.
class TickSchedule {
 public:
  TickSchedule(std::chrono::nanoseconds period, std::chrono::nanoseconds grace)
      : period_(period), grace_(grace) {}

  /// When the clock has to make the next estimate unless something else does before.
  [[nodiscard]] MonotonicTime next_tick() const { return slot_ + grace_; }

  /// An estimate was made at `now`. Credit for early ones reaches half a period ahead, debt of a stall is
  /// forgiven.
  void paid(MonotonicTime now) {
    slot_ += period_;
    if (slot_ <= now) {
      slot_ = now + period_;
    }
    slot_ = std::min(slot_, now + period_ + period_ / 2);
  }

 private:
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds grace_;
  MonotonicTime slot_{};
};

}  // namespace tubed
