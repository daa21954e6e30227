// Both clocks of the host at one moment: monotonic inside the daemon, real time on the wire.
#pragma once

#include <cstdint>

namespace tubed {

struct ClockPair {
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;

  /// The real time of a monotonic instant, by today's offset: right as long as nobody stepped the clock in
  /// between.
  [[nodiscard]] std::int64_t to_realtime_ns(std::int64_t instant_monotonic_ns) const {
    return instant_monotonic_ns + (realtime_ns - monotonic_ns);
  }
};

/// CLOCK_MONOTONIC and CLOCK_REALTIME now. Any thread.
ClockPair read_clocks();

}  // namespace tubed
