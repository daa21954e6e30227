#include "drivers/aurora_can/gateway_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr MonotonicTime kStart = from_ns(5'000'000'000);

double ms_between(MonotonicTime from, MonotonicTime to) { return 1e3 * seconds_between(from, to); }

TEST(GatewayClock, FindsTheTimeBehindTheDelayOfTheBus) {
  GatewayClock clock;
  // Sent every 25 ms, received 0.2 to 3.1 ms later; measured 22 ms before it was sent.
  for (int i = 0; i < 100; ++i) {
    const MonotonicTime sent = kStart + i * milliseconds(25);
    const MonotonicTime received = sent + microseconds(200 + 290 * (i * 7 % 11));
    const auto sent_us = static_cast<std::uint32_t>(777'000'000 + 25'000 * i);
    clock.observe(sent_us, received);
    const MonotonicTime measured = clock.at(sent_us - 22'000, received);
    if (i >= 11) {
      EXPECT_NEAR(ms_between(sent - milliseconds(22), measured), 0.2, 1e-3);
    }
  }
  EXPECT_EQ(clock.disbelieved(), 0U);
}

TEST(GatewayClock, GoesOnThroughTheWrapOfTheMicroseconds) {
  GatewayClock clock;
  for (int i = 0; i < 40; ++i) {
    const MonotonicTime received = kStart + i * milliseconds(25);
    const auto sent_us =
        static_cast<std::uint32_t>(0xFFFF'FFFFU - 500'000 + 25'000U * static_cast<unsigned>(i));
    clock.observe(sent_us, received);
    EXPECT_NEAR(ms_between(received, clock.at(sent_us - 10'000, received)), -10, 1e-3);
  }
  EXPECT_EQ(clock.disbelieved(), 0U);
}

TEST(GatewayClock, FollowsACrystalThatRunsFast) {
  GatewayClock clock;
  constexpr double kFast = 1 + 100e-6;
  for (int i = 0; i < 40 * 120; ++i) {
    const MonotonicTime received = kStart + i * milliseconds(25);
    const auto sent_us = static_cast<std::uint32_t>(std::llround(25'000.0 * i * kFast));
    clock.observe(sent_us, received);
    ASSERT_NEAR(ms_between(received, clock.at(sent_us, received)), 0, 0.41) << i;
    const MonotonicTime slow = clock.at(sent_us - 1000, received);
    ASSERT_LE(slow, received);
  }
}

TEST(GatewayClock, DoesNotBelieveAGatewayThatWasRestarted) {
  GatewayClock clock;
  clock.observe(1'000'000, kStart);
  const MonotonicTime later = kStart + seconds(1);
  clock.observe(5, later);
  EXPECT_EQ(clock.at(5, later), later);
  EXPECT_EQ(clock.disbelieved(), 1U);
  clock.observe(25'005, later + milliseconds(25));
  EXPECT_EQ(clock.at(20'005, later + milliseconds(25)), later + milliseconds(20));
}

TEST(GatewayClock, ForgetsWhatIsOlderThanFourSeconds) {
  GatewayClock clock;
  clock.observe(0, kStart);  // soonest of all
  for (int i = 1; i <= 40 * 6; ++i) {
    clock.observe(static_cast<std::uint32_t>(25'000 * i), kStart + i * milliseconds(25) + milliseconds(4));
  }
  const MonotonicTime received = kStart + seconds(6) + milliseconds(4);
  EXPECT_EQ(clock.at(6'000'000, received), received);
}

TEST(GatewayClock, WithoutAnyFrameTheArrivalCounts) {
  GatewayClock clock;
  EXPECT_EQ(clock.at(123, kStart), kStart);
}

}  // namespace
}  // namespace tubed
