#include "drivers/aurora/frame_admission.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Verdict = FrameAdmission::Verdict;

constexpr double kPeriodNs = 25e6;
constexpr MonotonicTime kStart = from_ns(5'000'000'000);

/// A tracker that counts 8 every 25 ms from `first` on.
std::uint32_t number_at(MonotonicTime time, std::uint32_t first = 1000) {
  return first + 8 * static_cast<std::uint32_t>((time - kStart) / milliseconds(25));
}

/// After a second of tracking from kStart on.
FrameAdmission tracking(std::uint32_t first = 1000) {
  FrameAdmission admission;
  for (MonotonicTime now = kStart; now < kStart + seconds(1); now += milliseconds(25)) {
    admission.judge(number_at(now, first), now, kPeriodNs);
  }
  return admission;
}

TEST(FrameAdmission, BelievesTheFirstNumberOnlyWhenASecondOneConfirmsThatItMoves) {
  FrameAdmission admission;
  EXPECT_EQ(admission.judge(1000, kStart, kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(1000, kStart + milliseconds(10), kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(1008, kStart + milliseconds(30), kPeriodNs), Verdict::kConfirmed);
  EXPECT_EQ(admission.judge(1016, kStart + milliseconds(55), kPeriodNs), Verdict::kExpected);
  EXPECT_EQ(admission.last(), 1016U);
}

TEST(FrameAdmission, BelievesACounterAtOnceThatWentOnOverARestart) {
  FrameAdmission admission = tracking();
  admission.tracking_started();
  const MonotonicTime later = kStart + milliseconds(4300);
  EXPECT_EQ(admission.judge(number_at(later), later, kPeriodNs), Verdict::kExpected);
}

TEST(FrameAdmission, NeverBelievesACounterThatStandsStillOverRestarts) {
  FrameAdmission admission = tracking();
  const std::uint32_t standing = admission.last();
  for (int restart = 1; restart <= 5; ++restart) {
    admission.tracking_started();
    for (int poll = 0; poll < 40; ++poll) {
      const MonotonicTime now = kStart + seconds(1 + 3 * restart) + poll * milliseconds(25);
      EXPECT_EQ(admission.judge(standing, now, kPeriodNs), Verdict::kHeldBack);
    }
  }
}

TEST(FrameAdmission, DoesNotBelieveTheFirstStepOfACounterThatStoodStill) {
  FrameAdmission admission = tracking();
  admission.tracking_started();
  const std::uint32_t standing = admission.last();
  EXPECT_EQ(admission.judge(standing, kStart + seconds(4), kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(standing + 8, kStart + seconds(16), kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(standing + 16, kStart + seconds(16) + milliseconds(25), kPeriodNs),
            Verdict::kConfirmed);
}

TEST(FrameAdmission, HoldsBackAJumpUntilTheCounterMovesThere) {
  FrameAdmission admission = tracking();
  const MonotonicTime now = kStart + seconds(1);
  EXPECT_EQ(admission.judge(500'000, now, kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(500'000, now + milliseconds(10), kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(500'008, now + milliseconds(25), kPeriodNs), Verdict::kConfirmed);
}

TEST(FrameAdmission, FollowsACounterThatStartsAgainAtZero) {
  FrameAdmission admission = tracking(1'000'000);
  admission.tracking_started();
  const MonotonicTime now = kStart + seconds(5);
  EXPECT_EQ(admission.judge(8, now, kPeriodNs), Verdict::kHeldBack);
  EXPECT_EQ(admission.judge(16, now + milliseconds(25), kPeriodNs), Verdict::kConfirmed);
}

TEST(FrameAdmission, TakesALateReplyForWhatItIs) {
  FrameAdmission admission = tracking();
  const std::uint32_t newest = admission.last();
  EXPECT_EQ(admission.judge(newest - 16, kStart + seconds(1), kPeriodNs), Verdict::kExpected);
  EXPECT_EQ(admission.last(), newest);
}

TEST(FrameAdmission, CountsThroughTheWrap) {
  FrameAdmission admission = tracking(0xFFFFFFFFU - 100);
  const MonotonicTime later = kStart + milliseconds(1300);
  EXPECT_EQ(admission.judge(number_at(later, 0xFFFFFFFFU - 100), later, kPeriodNs), Verdict::kExpected);
}

}  // namespace
}  // namespace tubed::aurora
