#include "daemon/publishing/clock_pair.hpp"

#include <ctime>

namespace tubed {
namespace {

std::int64_t read_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

ClockPair read_clocks() {
  return {.monotonic_ns = read_ns(CLOCK_MONOTONIC), .realtime_ns = read_ns(CLOCK_REALTIME)};
}

}  // namespace tubed
