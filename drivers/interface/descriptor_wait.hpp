// Waiting for a descriptor with a deadline, for drivers.
#pragma once

#include <poll.h>
#include <time.h>

#include <algorithm>
#include <cerrno>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

/// Waits until `descriptor` is ready for `events` (those of poll(2)) or fails; false when `deadline` came
/// first. A deadline in the past only looks. Never allocates.
inline bool wait_for(int descriptor, short events, MonotonicTime deadline) noexcept {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  pollfd waiting{descriptor, events, 0};
  for (;;) {
    const std::int64_t left_ns = std::max<std::int64_t>((deadline - monotonic_now()).count(), 0);
    const timespec left{static_cast<time_t>(left_ns / kNsPerSecond),
                        static_cast<long>(left_ns % kNsPerSecond)};
    const int ready = ::ppoll(&waiting, 1, &left, nullptr);
    if (ready >= 0 || errno != EINTR) {
      return ready > 0;
    }
  }
}

}  // namespace tubed
