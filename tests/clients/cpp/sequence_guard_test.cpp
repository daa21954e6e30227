#include "clients/cpp/sequence_guard.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

constexpr double kMaxRate_hz = 120;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPeriod_ns = kSecond_ns / 30;
constexpr std::int64_t kUptime_ns = 1000 * kSecond_ns;  // of the daemon's host, when a test begins

/// A guard, and samples that arrive when they are published.
class SequenceGuardTest : public ::testing::Test {
 protected:
  static SampleOrigin sample(std::uint64_t number, std::int64_t time_ns) {
    return {.daemon_start = 9,
            .sequence_number = number,
            .publish_monotonic_ns = kUptime_ns + time_ns,
            .writer = 1};
  }

  Order arrives(std::uint64_t number, std::int64_t time_ns) {
    return arrives_at(time_ns, sample(number, time_ns));
  }

  Order arrives_at(std::int64_t now_ns, const SampleOrigin& origin) {
    const Order order = guard_.order_of(origin, now_ns);
    if (order == Order::kFirst || order == Order::kNext) guard_.accept(origin, now_ns);
    if (order == Order::kImplausible) guard_.refuse_jump(origin, now_ns);
    return order;
  }

  SequenceGuard guard_{kMaxRate_hz};
};

TEST_F(SequenceGuardTest, NumbersThatGoForwardAreAccepted) {
  EXPECT_EQ(arrives(5, 100), Order::kFirst);
  EXPECT_EQ(arrives(6, 101), Order::kNext);
  EXPECT_EQ(arrives(9, 102), Order::kNext);
  EXPECT_EQ(guard_.newest_number(), 9U);
}

TEST_F(SequenceGuardTest, TheSameOrASmallerNumberIsAReplay) {
  arrives(5, 100);

  EXPECT_EQ(arrives(5, 101), Order::kBackward);
  EXPECT_EQ(arrives(4, 102), Order::kBackward);
  EXPECT_EQ(arrives(6, 103), Order::kNext);
}

TEST_F(SequenceGuardTest, ALargerNumberFromAnEarlierTimeIsRefused) {
  arrives(5, 100);

  EXPECT_EQ(arrives(6, 99), Order::kBackward);
}

TEST_F(SequenceGuardTest, ANumberCannotOutrunRateTimesTimeAndTheGenuineOnesGoOn) {
  arrives(1, 0);

  EXPECT_EQ(arrives(std::uint64_t{1} << 60U, kPeriod_ns), Order::kImplausible);
  EXPECT_EQ(arrives(2, kPeriod_ns), Order::kNext);
  EXPECT_EQ(arrives(2 + 120 * 10 + 60, 10 * kSecond_ns + kPeriod_ns), Order::kNext);  // 120 Hz and the margin
  EXPECT_EQ(arrives(2 + 120 * 20 + 122, 20 * kSecond_ns + kPeriod_ns), Order::kImplausible);
}

TEST_F(SequenceGuardTest, AFirstNumberCannotBeOlderThanItsHost) {
  EXPECT_EQ(arrives(120 * 1000 + 61, 0), Order::kImplausible);
  EXPECT_EQ(arrives(120 * 1000 + 60, 0), Order::kFirst);
}

TEST_F(SequenceGuardTest, AfterTheClockOfThisHostStoodStillForAnHourSamplesAreAcceptedWithinTwoSeconds) {
  arrives(1, 0);
  std::int64_t accepted_ns = 0;
  for (int k = 1; k < 90 && accepted_ns == 0; ++k) {
    const SampleOrigin later =
        sample(108'000 + static_cast<std::uint64_t>(k), 3600 * kSecond_ns + k * kPeriod_ns);
    if (arrives_at(k * kPeriod_ns, later) == Order::kNext) accepted_ns = k * kPeriod_ns;
  }
  EXPECT_GT(accepted_ns, kSecond_ns);
  EXPECT_LT(accepted_ns, 2 * kSecond_ns);
}

TEST_F(SequenceGuardTest, JumpsAreNeverAcceptedWhileTheGenuineOnesCome) {
  for (std::uint64_t k = 1; k < 300; ++k) {
    const std::int64_t time_ns = static_cast<std::int64_t>(k) * kPeriod_ns;
    EXPECT_EQ(arrives(k, time_ns), k == 1 ? Order::kFirst : Order::kNext) << k;
    EXPECT_EQ(arrives(1'000'000 + k, time_ns), Order::kImplausible) << k;
  }
}

}  // namespace
}  // namespace tubed
