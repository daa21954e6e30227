// When the rows of a folder are due, from the driver's settings.
#pragma once

#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead.hpp"
#include "drivers/replay/replayed_folder.hpp"

namespace tubed {

/// A playhead over rows with a `t_s`, begun at the folder's start or the one that the settings give.
template <typename Rows>
Playhead playhead_over(const Rows& rows, const ReplayedFolder& folder, const DriverSettings& settings) {
  std::vector<std::chrono::nanoseconds> times;
  times.reserve(rows.size());
  for (const auto& row : rows) {
    times.push_back(to_nanoseconds(row.t_s));
  }
  const auto end = settings.get<bool>("loop") ? ReplayEnd::kLoops : ReplayEnd::kStops;
  const std::int64_t start_ns = settings.get<std::int64_t>("start_monotonic_ns");
  Playhead playhead(std::move(times), folder.lap, end);
  playhead.begin(start_ns == 0 ? folder.start : from_ns(start_ns), monotonic_now());
  return playhead;
}

}  // namespace tubed
