// How long to wait for the next EM measurement before saying that they are stale: a tracker at 66 Hz is late
// sooner than one at 40 Hz, and a slow line makes none stale.
#pragma once

#include <algorithm>
#include <chrono>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Learns the period of the measurements, and how long they are under way. A value of the thread that sees
/// them; never allocates.
class EmTimeout {
 public:
  /// The next measurement.
  void saw(MonotonicTime measured, MonotonicTime received) {
    const std::chrono::nanoseconds interval = measured - newest_;
    newest_ = std::max(newest_, measured);
    if (interval >= kMinInterval && interval < kMaxInterval) {
      learn(period_, interval);
    }
    learn(under_way_, std::clamp<std::chrono::nanoseconds>(received - measured, kNothing, kMaxInterval));
  }

  /// Age of the newest measurement from which on they are stale: one may be lost without a word (its
  /// successor is two periods and the way old when it is due, and may be 0.3 periods late),
  /// the second in a row is said. `max_timeout` while the period is not known, and never more than that.
  [[nodiscard]] std::chrono::nanoseconds timeout(std::chrono::nanoseconds max_timeout) const {
    return period_ == kNothing ? max_timeout
                               : std::min(max_timeout, std::max<std::chrono::nanoseconds>(
                                                           period_ * 23 / 10 + under_way_, kMinTimeout));
  }

 private:
  // What is half as long again or more was mostly a lost measurement, or a late reply: it counts little.
  static void learn(std::chrono::nanoseconds& usual, std::chrono::nanoseconds now) {
    constexpr int kShare = 8;
    constexpr int kShareOfUnusual = 64;
    usual =
        usual == kNothing ? now : usual + (now - usual) / (2 * now < 3 * usual ? kShare : kShareOfUnusual);
  }

  static constexpr std::chrono::nanoseconds kNothing{0};
  static constexpr std::chrono::milliseconds kMinInterval{2};
  static constexpr std::chrono::milliseconds kMaxInterval{1000};
  static constexpr std::chrono::milliseconds kMinTimeout{40};
  MonotonicTime newest_{};
  std::chrono::nanoseconds period_{0};
  std::chrono::nanoseconds under_way_{0};
};

}  // namespace tubed
