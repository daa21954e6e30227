#include "daemon/pipeline/image_rate_limit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tubed {
namespace {

using std::chrono::nanoseconds;

constexpr double kRateHz = 30;
constexpr int kSeconds = 60;

nanoseconds seconds(double s) { return nanoseconds{static_cast<std::int64_t>(s * 1e9)}; }

/// Images a second that go on, of `rate_hz` with a uniform jitter of +- `jitter_s`.
double passed_hz(double rate_hz, double jitter_s = 0) {
  ImageRateLimit limit(kRateHz);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-jitter_s, jitter_s);
  const MonotonicTime start = from_ns(1'000'000'000'000);
  int passed = 0;
  for (int k = 0; k < static_cast<int>(rate_hz * kSeconds); ++k) {
    passed += limit.lets_through(start + seconds(k / rate_hz + jitter(random))) ? 1 : 0;
  }
  return static_cast<double>(passed) / kSeconds;
}

TEST(ImageRateLimit, ImagesAtTheRateAndSlowerAllGoOn) {
  for (const double rate_hz : {1.0, 7.5, 15.0, 29.97, 30.0, 30.3}) {
    EXPECT_NEAR(passed_hz(rate_hz), rate_hz, 0.02) << rate_hz;
  }
}

TEST(ImageRateLimit, JitterOfHalfAPeriodCostsNoImage) { EXPECT_NEAR(passed_hz(30, 0.0166), 30, 0.02); }

TEST(ImageRateLimit, FasterImagesAreThinnedOutToTheRateAndNeverBelowIt) {
  for (const double rate_hz : {31.0, 45.0, 60.0, 121.0, 300.0, 5000.0}) {
    EXPECT_GE(passed_hz(rate_hz), 30) << rate_hz;
    EXPECT_LE(passed_hz(rate_hz), 30.7) << rate_hz;
  }
}

TEST(ImageRateLimit, WhatGoesOnGoesOnAtOnceAndTheGapIsAtMostTwoPeriods) {
  ImageRateLimit limit(kRateHz);
  const MonotonicTime start = from_ns(1'000'000'000'000);
  MonotonicTime previous = start;
  for (int k = 0; k < 3000; ++k) {
    const MonotonicTime now = start + seconds(k / 300.0);
    if (limit.lets_through(now)) {
      EXPECT_LE(now - previous, seconds(2 / kRateHz));
      previous = now;
    }
  }
}

TEST(ImageRateLimit, APauseIsNotMadeUpForByABurst) {
  ImageRateLimit limit(kRateHz);
  const MonotonicTime start = from_ns(1'000'000'000'000);
  limit.lets_through(start);
  int passed = 0;
  for (int k = 0; k < 100; ++k) {
    passed += limit.lets_through(start + std::chrono::seconds(10) + std::chrono::microseconds(k)) ? 1 : 0;
  }
  EXPECT_LE(passed, 2);
}

}  // namespace
}  // namespace tubed
