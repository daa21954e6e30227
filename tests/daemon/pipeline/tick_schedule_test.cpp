#include "daemon/pipeline/tick_schedule.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr nanoseconds kPeriod{33'333'333};
constexpr nanoseconds kGrace = milliseconds(10);
constexpr nanoseconds kClockStep = microseconds(100);
constexpr MonotonicTime kStart = from_ns(1'000'000'000'000);

struct Count {
  int images = 0;
  int ticks = 0;
  nanoseconds max_gap{0};
  nanoseconds min_tick_gap{std::chrono::hours(1)};
};

// Ten seconds with an image every `image_period`, on a clock of 0.1 ms steps.
Count run(nanoseconds image_period, nanoseconds images_end = std::chrono::hours(1)) {
  TickSchedule schedule(kPeriod, kGrace);
  schedule.paid(kStart);
  Count count;
  MonotonicTime next_image = kStart + image_period;
  MonotonicTime previous = kStart;
  for (MonotonicTime now = kStart; now < kStart + std::chrono::seconds(10); now += kClockStep) {
    const bool image = now >= next_image && now - kStart < images_end;
    const bool tick = !image && now >= schedule.next_tick();
    if (image || tick) {
      (image ? count.images : count.ticks) += 1;
      count.max_gap = std::max(count.max_gap, nanoseconds(now - previous));
      count.min_tick_gap =
          tick ? std::min(count.min_tick_gap, nanoseconds(now - previous)) : count.min_tick_gap;
      previous = now;
      schedule.paid(now);
    }
    next_image += image ? image_period : nanoseconds(0);
  }
  return count;
}

TEST(TickSchedule, WithoutImagesTheClockMakesThirtyASecond) {
  const Count count = run(std::chrono::hours(1));
  EXPECT_EQ(count.images, 0);
  EXPECT_NEAR(count.ticks, 300, 1);
  EXPECT_LE(count.max_gap, kPeriod + kGrace + kClockStep);
}

TEST(TickSchedule, WithThirtyImagesASecondThereIsNoTick) {
  const Count count = run(kPeriod);
  EXPECT_NEAR(count.images, 300, 1);
  EXPECT_EQ(count.ticks, 0);
}

TEST(TickSchedule, SlowerImagesAreCompletedToThirty) {
  for (const double image_hz : {7.5, 10.0, 15.0, 20.0, 25.0, 29.0, 29.97}) {
    const Count count = run(nanoseconds(static_cast<std::int64_t>(1e9 / image_hz)));
    EXPECT_NEAR(count.images, 10 * image_hz, 1.5) << image_hz;
    EXPECT_NEAR(count.images + count.ticks, 300, 3) << image_hz;
  }
}

TEST(TickSchedule, FasterImagesAreNotThinnedOut) {
  const Count count = run(nanoseconds(16'666'667));
  EXPECT_NEAR(count.images, 600, 1);
  EXPECT_EQ(count.ticks, 0);
}

TEST(TickSchedule, WhenImagesStopTheFirstTickComesWithinTwoPeriods) {
  const Count count = run(nanoseconds(16'666'667), std::chrono::seconds(5));
  EXPECT_LE(count.max_gap, 2 * kPeriod);
}

TEST(TickSchedule, AStallIsNotMadeUpForByABurst) {
  TickSchedule schedule(kPeriod, kGrace);
  schedule.paid(kStart);
  const MonotonicTime after = kStart + std::chrono::seconds(3);
  ASSERT_LE(schedule.next_tick(), after);
  schedule.paid(after);
  EXPECT_GE(schedule.next_tick(), after + kPeriod / 2);
}

}  // namespace
}  // namespace tubed
