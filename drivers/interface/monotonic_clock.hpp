// The host's CLOCK_MONOTONIC, for drivers: they alone, with the stage thread, publishing and the bench, look
// at it.
#pragma once

#include <time.h>

#include <algorithm>
#include <cerrno>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

inline MonotonicTime monotonic_now() noexcept {
  return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now());
}

/// Sleeps until `due` or `deadline`, whichever comes first; true when `due` has come. An instant in the past
/// returns at once. Never allocates.
inline bool sleep_until(MonotonicTime due, MonotonicTime deadline) noexcept {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  const std::int64_t until_ns = to_ns(std::min(due, deadline));
  if (to_ns(monotonic_now()) < until_ns) {
    const timespec until{static_cast<time_t>(until_ns / kNsPerSecond),
                         static_cast<long>(until_ns % kNsPerSecond)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
  }
  return monotonic_now() >= due;
}

}  // namespace tubed
