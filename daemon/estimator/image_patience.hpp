// How long to wait for the next image before saying that images are stale: a fluoroscope at 7.5 Hz is not
// late after 100 ms, one at 30 Hz is.
#pragma once

#include <algorithm>
#include <chrono>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Learns the period of the image instants (exposures, and announced instants without radiation). A value of
/// the thread that sees them; never allocates.
class ImagePatience {
 public:
  /// The next instant of any camera; two views of one instant count once.
  void saw_instant(MonotonicTime instant) {
    const std::chrono::nanoseconds interval = instant - newest_;
    newest_ = std::max(newest_, instant);
    if (interval < kShortest || interval >= kLongest) {
      return;
    }
    period_ = period_.count() == 0 ? interval : period_ + (interval - period_) / 8;
  }

  /// Two periods and a little; `most` while the period is not known, and never more than that.
  [[nodiscard]] std::chrono::nanoseconds patience(std::chrono::nanoseconds most) const {
    return period_.count() == 0 ? most
                                : std::min(most, std::max<std::chrono::nanoseconds>(period_ * 9 / 4, kLeast));
  }

 private:
  static constexpr std::chrono::milliseconds kShortest{4};
  static constexpr std::chrono::milliseconds kLongest{1000};
  static constexpr std::chrono::milliseconds kLeast{50};
  MonotonicTime newest_{};
  std::chrono::nanoseconds period_{0};
};

}  // namespace tubed
