// How long to wait for the next image before saying that images are stale: a fluoroscope at 7.5 Hz is not
// late after 100 ms, one at 30 Hz is.
#pragma once

#include <algorithm>
#include <chrono>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Learns the period of the image instants (exposures, and announced instants without radiation). A value of
/// the thread that sees them; never allocates.
class ImageTimeout {
 public:
  /// The next instant of any camera; two views of one instant count once.
  void saw_instant(MonotonicTime instant) {
    const std::chrono::nanoseconds interval = instant - newest_;
    newest_ = std::max(newest_, instant);
    if (interval < kMinInterval || interval >= kMaxInterval) {
      return;
    }
    period_ = period_.count() == 0 ? interval : period_ + (interval - period_) / 8;
  }

  /// Two periods and a little; `max_timeout` while the period is not known, and never more than that.
  [[nodiscard]] std::chrono::nanoseconds timeout(std::chrono::nanoseconds max_timeout) const {
    return period_.count() == 0
               ? max_timeout
               : std::min(max_timeout, std::max<std::chrono::nanoseconds>(period_ * 9 / 4, kMinTimeout));
  }

 private:
  static constexpr std::chrono::milliseconds kMinInterval{4};
  static constexpr std::chrono::milliseconds kMaxInterval{1000};
  static constexpr std::chrono::milliseconds kMinTimeout{50};
  MonotonicTime newest_{};
  std::chrono::nanoseconds period_{0};
};

}  // namespace tubed
