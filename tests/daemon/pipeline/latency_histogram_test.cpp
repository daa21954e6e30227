#include "daemon/pipeline/latency_histogram.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::microseconds;

TEST(LatencyHistogram, QuantilesAreAtMostOneBucketTooLong) {
  LatencyHistogramValues values;
  for (int us = 1; us <= 1000; ++us) {
    count_latency(values, microseconds(us));
  }
  EXPECT_EQ(values.count, 1000U);
  EXPECT_GE(latency_quantile_ns(values, 0.5), 500e3);
  EXPECT_LE(latency_quantile_ns(values, 0.5), 500e3 * 1.19);
  EXPECT_EQ(latency_quantile_ns(values, 1.0), 1e6) << "never beyond the longest";
}

TEST(LatencyHistogram, TheShortestAndTheEndlessHaveABucketToo) {
  LatencyHistogramValues values;
  count_latency(values, std::chrono::nanoseconds(0));
  count_latency(values, std::chrono::hours(1));
  EXPECT_EQ(values.buckets.front(), 1U);
  EXPECT_EQ(values.buckets.back(), 1U);
}

TEST(LatencyHistogram, NothingCountedHasNoQuantile) {
  EXPECT_EQ(latency_quantile_ns(LatencyHistogramValues{}, 0.5), 0);
}

}  // namespace
}  // namespace tubed
