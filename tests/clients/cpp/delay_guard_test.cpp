#include "clients/cpp/delay_guard.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tubed {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLongest = 200 * kMs;
constexpr std::uint64_t kStart = 7;
constexpr std::int64_t kOffset = -5'000'000 * kMs;  // what this host's clock is behind the daemon's

/// Published at `at_ms`, received `delay_ms` later.
bool late(DelayGuard& guard, std::int64_t at_ms, std::int64_t delay_ms, std::uint64_t start = kStart) {
  return guard.judge(start, at_ms * kMs, (at_ms + delay_ms) * kMs + kOffset) == Delay::kLate;
}

/// Received at `at_ms`, and said to have been published `ahead_ms` later.
Delay ahead(DelayGuard& guard, std::int64_t at_ms, std::int64_t ahead_ms) {
  return guard.judge(kStart, (at_ms + ahead_ms) * kMs, at_ms * kMs + kOffset);
}

TEST(DelayGuard, WhatWaitedInAStoppedProcessIsLateAndWhatComesAfterItIsNot) {
  DelayGuard guard(kLongest);
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(late(guard, 33 * i, 1));

  EXPECT_TRUE(late(guard, 1000, 8000));
  EXPECT_TRUE(late(guard, 1033, 7967));
  EXPECT_FALSE(late(guard, 9000, 1));
}

TEST(DelayGuard, JitterBelowTheLimitIsNotLate) {
  DelayGuard guard(kLongest);
  for (int i = 0; i < 300; ++i) EXPECT_FALSE(late(guard, 33 * i, 1 + (37 * i) % 199)) << i;
}

TEST(DelayGuard, AnotherStartHasAnotherClock) {
  DelayGuard guard(kLongest);
  EXPECT_FALSE(late(guard, 0, 1));
  EXPECT_FALSE(late(guard, 0, 60'000, kStart + 1));
  EXPECT_FALSE(late(guard, 33, 60'000, kStart + 1));
}

TEST(DelayGuard, AfterAClockStoodStillSamplesAreHeardAgainWithinASecond) {
  DelayGuard guard(kLongest);
  EXPECT_FALSE(late(guard, 0, 1));

  int refused = 0;
  for (int i = 1; i <= 90; ++i) refused += late(guard, 33 * i, 600'000) ? 1 : 0;

  EXPECT_GE(refused, 30);
  EXPECT_LE(refused, 31);
}

TEST(DelayGuard, ClocksThatDriftApartAreFollowed) {
  DelayGuard guard(kLongest);
  for (int s = 0; s < 36'000; ++s) {
    const std::int64_t drift_ms = s / 10;  // 100 ppm for ten hours: 3.6 s
    EXPECT_FALSE(late(guard, 1000 * s, 1 + drift_ms)) << s;
  }
}

TEST(DelayGuard, ATimeThatRunsAheadOfNowIsRefusedAndTheUsualOnesGoOn) {
  DelayGuard guard(kLongest);
  for (int i = 0; i < 300; ++i) {
    EXPECT_EQ(ahead(guard, 33 * i, 0), Delay::kUsual) << i;
    EXPECT_EQ(ahead(guard, 33 * i + 5, 206 + 1000 * i), Delay::kEarly) << i;
  }
}

TEST(DelayGuard, AfterThisHostSleptSamplesAreHeardAgainWithin200Milliseconds) {
  DelayGuard guard(kLongest);
  for (int i = 0; i < 300; ++i) EXPECT_FALSE(late(guard, 33 * i, 1));
  int heard = 0;
  for (int i = 0; i < 30; ++i) heard += ahead(guard, 10'000 + 33 * i, 60'000) == Delay::kUsual ? 1 : 0;
  EXPECT_GE(heard, 30 - 200 / 33);
}

TEST(DelayGuard, WhenAQueueIsEmptyAgainTheUsualDelayIsNoTimeAheadOfNow) {
  DelayGuard guard(kLongest);
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(late(guard, 33 * i, 1));
  for (int i = 0; i < 60; ++i) late(guard, 1000 + 33 * i, 5000);

  EXPECT_EQ(guard.judge(kStart, 9000 * kMs, 9001 * kMs + kOffset), Delay::kUsual);
}

TEST(DelayGuard, ATimeAtTheEndsOfTheRangeIsLateOrEarlyAndNotTheOpposite) {
  DelayGuard guard(kLongest);
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(late(guard, 33 * i, 1));
  constexpr std::int64_t kNow = 1000 * kMs + kOffset;

  EXPECT_EQ(guard.judge(kStart, std::numeric_limits<std::int64_t>::min(), kNow), Delay::kLate);
  EXPECT_EQ(guard.judge(kStart, std::numeric_limits<std::int64_t>::max(), kNow), Delay::kEarly);
  EXPECT_FALSE(late(guard, 1033, 1));
}

}  // namespace
}  // namespace tubed
