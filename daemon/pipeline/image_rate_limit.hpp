// Images that come faster than estimates are asked for.
#pragma once

#include <algorithm>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// A value of the image grab thread. Of images at any rate at most `rate_hz` a second go on, each at once:
/// one that does not is superseded by the next that does, within a period. Images at the rate itself all go
/// on, with jitter of up to a period.
class ImageRateLimit {
 public:
  explicit ImageRateLimit(double rate_hz)
      : period_(static_cast<std::int64_t>(1e9 / (rate_hz * kTolerance))) {}

  /// Whether an image that came at `now` goes on. By arrival: a time of exposure is the source's own word.
  bool lets_through(MonotonicTime now) {
    if (now + period_ < paid_until_) {
      return false;
    }
    paid_until_ = std::max(paid_until_, now) + period_;
    return true;
  }

 private:
  // The source's clock is not the host's, and 30 Hz may be 30.3: without it a source at exactly the rate
  // would lose an image every few minutes.
  static constexpr double kTolerance = 1.02;

  std::chrono::nanoseconds period_;
  MonotonicTime paid_until_{};  ///< each image that goes on pays for a period
};

}  // namespace tubed
