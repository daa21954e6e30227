// Time as a value. Only drivers, the stage thread, publishing and bench read a clock; everybody else is given
// one of these.
#pragma once

#include <chrono>
#include <cstdint>

namespace tubed {

/// An instant of the host's CLOCK_MONOTONIC (what std::chrono::steady_clock reads on Linux), ns.
using MonotonicTime = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;

constexpr std::int64_t to_ns(MonotonicTime time) { return time.time_since_epoch().count(); }
constexpr MonotonicTime from_ns(std::int64_t ns) { return MonotonicTime{std::chrono::nanoseconds{ns}}; }
constexpr double seconds_between(MonotonicTime from, MonotonicTime to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace tubed
