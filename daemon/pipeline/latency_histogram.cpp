#include "daemon/pipeline/latency_histogram.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

void count_latency(LatencyHistogramValues& values, std::chrono::nanoseconds duration) {
  const auto us = static_cast<double>(duration.count()) * 1e-3;
  const int bucket = us < 1 ? 0 : static_cast<int>(4 * std::log2(us));
  ++values.buckets[static_cast<std::size_t>(std::clamp(bucket, 0, kLatencyBuckets - 1))];
  ++values.count;
  values.max_ns = std::max(values.max_ns, static_cast<std::int64_t>(duration.count()));
}

double latency_quantile_ns(const LatencyHistogramValues& values, double quantile) {
  if (values.count == 0) {
    return 0;
  }
  const double wanted = quantile * static_cast<double>(values.count);
  double counted = 0;
  for (int i = 0; i < kLatencyBuckets; ++i) {
    counted += values.buckets[static_cast<std::size_t>(i)];
    if (counted >= wanted && counted > 0) {
      return std::min(1e3 * std::exp2((i + 1) / 4.0), static_cast<double>(values.max_ns));
    }
  }
  return static_cast<double>(values.max_ns);
}

}  // namespace tubed
