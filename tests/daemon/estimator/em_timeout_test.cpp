#include "daemon/estimator/coils/em_timeout.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kMax{150};

/// After `count` measurements of that period, every `lost`th of which is lost (0: none).
EmTimeout after(nanoseconds period, nanoseconds under_way, int count, int lost = 0) {
  EmTimeout timeout;
  MonotonicTime time = from_ns(1'000'000'000);
  for (int i = 0; i < count; ++i, time += period) {
    if (lost == 0 || i % lost != lost - 1) {
      timeout.saw(time, time + under_way);
    }
  }
  return timeout;
}

double ms(nanoseconds time) { return static_cast<double>(time.count()) * 1e-6; }

TEST(EmTimeout, IsTheGreatestAllowedUntilThePeriodIsKnown) {
  EXPECT_EQ(EmTimeout().timeout(kMax), kMax);
  EXPECT_EQ(after(milliseconds(25), milliseconds(20), 1).timeout(kMax), kMax);
}

// Five coils at 115200 baud: 21 ms on the line. A shape is told within some milliseconds.
TEST(EmTimeout, EndsBeforeATenthOfASecondAtFortyHertzOverASlowLine) {
  EXPECT_NEAR(ms(after(milliseconds(25), milliseconds(21), 100).timeout(kMax)), 2.3 * 25 + 21, 0.1);
}

TEST(EmTimeout, IsShorterForAFasterTracker) {
  EXPECT_NEAR(ms(after(microseconds(15'150), milliseconds(8), 100).timeout(kMax)), 2.3 * 15.15 + 8, 0.1);
}

TEST(EmTimeout, OutlastsOneLostMeasurement) {
  for (const auto period : {microseconds(25'000), microseconds(15'150)}) {
    const nanoseconds under_way = milliseconds(10);
    EXPECT_GT(after(period, under_way, 100).timeout(kMax), 2 * period + under_way + period / 4);
  }
}

TEST(EmTimeout, IsNotLengthenedByLosses) {
  const auto whole = after(milliseconds(25), milliseconds(10), 400);
  const auto tenth_lost = after(milliseconds(25), milliseconds(10), 400, 10);
  EXPECT_NEAR(ms(tenth_lost.timeout(kMax)), ms(whole.timeout(kMax)), 1);
}

TEST(EmTimeout, LearnsThatTheTrackerHasBecomeSlower) {
  EmTimeout timeout = after(microseconds(15'150), milliseconds(5), 100);
  MonotonicTime time = from_ns(10'000'000'000);
  for (int i = 0; i < 200; ++i, time += milliseconds(40)) {
    timeout.saw(time, time + milliseconds(5));
  }
  EXPECT_NEAR(ms(timeout.timeout(kMax)), 2.3 * 40 + 5, 3);
}

TEST(EmTimeout, IsNeverLongerThanAllowed) {
  EXPECT_EQ(after(milliseconds(100), milliseconds(5), 100).timeout(kMax), kMax);
}

// An interruption is no period, and a clock that was set back no time under way.
TEST(EmTimeout, LearnsNothingFromAnInterruption) {
  EmTimeout timeout = after(milliseconds(25), milliseconds(10), 100);
  const nanoseconds before = timeout.timeout(kMax);
  timeout.saw(from_ns(60'000'000'000), from_ns(60'010'000'000));
  EXPECT_EQ(timeout.timeout(kMax), before);
  timeout.saw(from_ns(60'025'000'000), from_ns(59'000'000'000));
  EXPECT_LE(timeout.timeout(kMax), before);
}

}  // namespace
}  // namespace tubed
