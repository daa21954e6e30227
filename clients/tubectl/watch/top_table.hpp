// What `tubectl top` shows of one instrument. Pure: from two reports of the daemon and what lies between
// them.
#pragma once

#include <cstdint>
#include <string>

#include "TubeHealth.h"
#include "TubeIdentity.h"
#include "TubeStatus.h"

namespace tubed {

/// What was counted in `after` and not yet in `before`. Buckets that went backward (another start of the
/// daemon) count as they are in `after`. max_ns stays that of `after`: it knows no interval.
tubed_LatencyHistogram between(const tubed_LatencyHistogram& before, const tubed_LatencyHistogram& after);

/// The upper edge, ms, of the bucket that holds this quantile (0 .. 1): at most 19 % too much. Negative when
/// nothing was counted.
double quantile_ms(const tubed_LatencyHistogram& histogram, double quantile);

/// A table: the instrument's validity and latency, whether coils and images agree where they were compared
/// (cameras by their names where `identity` is told), then one line a stage: state, for how long, steps and
/// outputs a second, what was dropped, refused and reconnected since the start, time at work (p50, p90, p99
/// of the interval), and why it is not running. Rates are `-` unless `before` is of the same start of the
/// daemon and earlier.
std::string top_table(const tubed_TubeStatus& status, const tubed_TubeHealth& before,
                      const tubed_TubeHealth& after, const tubed_TubeIdentity* identity = nullptr);

}  // namespace tubed
