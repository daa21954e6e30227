#include "drivers/simulation/sample_clock.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr MonotonicTime kEpoch = from_ns(1'000'000'000);

TEST(SampleClock, SamplesAreTakenOnTheGridAndDueALatencyLater) {
  const SampleClock clock(kEpoch, 40, 12);
  EXPECT_EQ(clock.taken(3), kEpoch + milliseconds(75));
  EXPECT_EQ(clock.due(3), kEpoch + milliseconds(87));
}

TEST(SampleClock, TheFirstSampleComesAfterTheInstantAlsoBeforeTheEpoch) {
  const SampleClock clock(kEpoch, 40, 12);
  EXPECT_EQ(clock.first_after(kEpoch), 1);
  EXPECT_EQ(clock.first_after(kEpoch + milliseconds(24)), 1);
  EXPECT_EQ(clock.first_after(kEpoch - milliseconds(1)), 0);
  EXPECT_EQ(clock.first_after(kEpoch - milliseconds(26)), -1);
}

TEST(SampleClock, TheNewestDueIsTheLastWhoseLatencyIsOver) {
  const SampleClock clock(kEpoch, 40, 12);
  EXPECT_EQ(clock.newest_due(clock.due(5)), 5);
  EXPECT_EQ(clock.newest_due(clock.due(5) - std::chrono::nanoseconds(1)), 4);
}

TEST(SampleClock, WhatFallsIntoAStallIsLost) {
  const SampleClock clock(kEpoch, 40, 12);
  const MonotonicTime until = clock.due(10);
  EXPECT_EQ(clock.after_stall(4, until, clock.due(6)), 7) << "so far";
  EXPECT_EQ(clock.after_stall(7, until, clock.due(20)), 11) << "it is over";
  EXPECT_EQ(clock.after_stall(11, until, clock.due(20)), 11) << "and lost nothing else";
}

}  // namespace
}  // namespace tubed
