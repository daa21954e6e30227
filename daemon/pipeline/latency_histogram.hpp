// Log-spaced histogram of durations: four buckets an octave, from 1 us to 16 s.
#pragma once

#include <chrono>

#include "idl/estimate.hpp"

namespace tubed {

/// Counts `duration` in `values`. Never allocates.
void count_latency(LatencyHistogramValues& values, std::chrono::nanoseconds duration);

/// The duration below which the share `quantile` (0 .. 1) of the counted ones lie, ns: the upper edge of its
/// bucket (at most 19 % too long). 0 when nothing was counted.
double latency_quantile_ns(const LatencyHistogramValues& values, double quantile);

}  // namespace tubed
