#include "daemon/pipeline/doorbell.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace tubed {
namespace {

MonotonicTime now() { return std::chrono::steady_clock::now(); }

TEST(Doorbell, ARingBeforeTheWaitIsNotLost) {
  Doorbell bell;
  bell.ring();
  EXPECT_TRUE(bell.wait_until(now() + std::chrono::hours(1)));
}

TEST(Doorbell, SeveralRingsEndOneWait) {
  Doorbell bell;
  bell.ring();
  bell.ring();
  EXPECT_TRUE(bell.wait_until(now() + std::chrono::hours(1)));
  EXPECT_FALSE(bell.wait_until(now() + std::chrono::milliseconds(1)));
}

TEST(Doorbell, WithoutARingTheDeadlineEndsTheWait) {
  Doorbell bell;
  const MonotonicTime deadline = now() + std::chrono::milliseconds(20);
  EXPECT_FALSE(bell.wait_until(deadline));
  EXPECT_GE(now(), deadline);
}

TEST(Doorbell, EveryRingOfAnotherThreadWakesTheSleeper) {
  Doorbell there;
  Doorbell back;
  constexpr int kRounds = 2000;
  std::thread other([&] {
    for (int i = 0; i < kRounds; ++i) {
      there.wait_until(now() + std::chrono::seconds(10));
      back.ring();
    }
  });
  int answered = 0;
  for (int i = 0; i < kRounds; ++i) {
    there.ring();
    answered += back.wait_until(now() + std::chrono::seconds(10)) ? 1 : 0;
  }
  other.join();
  EXPECT_EQ(answered, kRounds);
}

}  // namespace
}  // namespace tubed
