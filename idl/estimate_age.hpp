// When an estimate is too old to leave the process.
#pragma once

#include <chrono>
#include <cstdint>

#include "idl/estimate.hpp"

namespace tubed {

/// An estimate begun so long ago was begun before a stall, also when it was finished afterwards: the process
/// may have been stopped in the middle of it. The next one is at most a period away. `now_ns`:
/// CLOCK_MONOTONIC.
inline bool is_history(const TubeEstimate& estimate, std::int64_t now_ns) {
  constexpr std::chrono::nanoseconds kStall = std::chrono::milliseconds{150};
  return now_ns - estimate.stamps.optimizer_started_ns > kStall.count();
}

}  // namespace tubed
