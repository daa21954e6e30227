// When the samples of a periodic source are taken and delivered. Reads no clock.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Sample k is taken at epoch + k periods and delivered a latency later.
class SampleClock {
 public:
  SampleClock(MonotonicTime epoch, double rate_hz, double latency_ms)
      : epoch_(epoch),
        period_(std::chrono::nanoseconds(std::llround(1e9 / rate_hz))),
        latency_(std::chrono::nanoseconds(std::llround(1e6 * latency_ms))) {}

  [[nodiscard]] MonotonicTime taken(std::int64_t k) const { return epoch_ + k * period_; }
  [[nodiscard]] MonotonicTime due(std::int64_t k) const { return taken(k) + latency_; }
  /// The first sample taken after `time`.
  [[nodiscard]] std::int64_t first_after(MonotonicTime time) const { return last_before(time - epoch_) + 1; }
  /// The newest sample that is due at `now`.
  [[nodiscard]] std::int64_t newest_due(MonotonicTime now) const {
    return last_before(now - latency_ - epoch_);
  }

  /// The sample to deliver after `next` when nothing may be delivered before `stalled_until`: those due until
  /// then (so far, at `now`) are lost.
  [[nodiscard]] std::int64_t after_stall(std::int64_t next, MonotonicTime stalled_until,
                                         MonotonicTime now) const {
    return due(next) > stalled_until ? next : std::max(next, newest_due(std::min(now, stalled_until)) + 1);
  }

 private:
  /// Rounds down, also before the epoch.
  [[nodiscard]] std::int64_t last_before(std::chrono::nanoseconds since_epoch) const {
    const std::int64_t k = since_epoch / period_;
    return since_epoch < k * period_ ? k - 1 : k;
  }

  MonotonicTime epoch_;
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds latency_;
};

}  // namespace tubed
