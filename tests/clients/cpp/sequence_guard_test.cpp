#include "clients/cpp/sequence_guard.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

/// A sample published at `time` on both clocks.
SampleOrigin sample(std::uint64_t daemon_start, std::uint64_t sequence_number, std::int64_t time) {
  return {.daemon_start = daemon_start,
          .sequence_number = sequence_number,
          .publish_monotonic_ns = time,
          .publish_time_ns = time};
}

TEST(SequenceGuard, NumbersThatGoForwardAreAcceptedAndGapsAreCounted) {
  SequenceGuard guard;

  EXPECT_EQ(guard.judge(sample(9, 5, 100)), Verdict::kFirst);
  EXPECT_EQ(guard.lost_before(), 0U);
  EXPECT_EQ(guard.judge(sample(9, 6, 101)), Verdict::kNext);
  EXPECT_EQ(guard.lost_before(), 0U);
  EXPECT_EQ(guard.judge(sample(9, 9, 102)), Verdict::kNext);
  EXPECT_EQ(guard.lost_before(), 2U);
}

TEST(SequenceGuard, TheSameOrASmallerNumberIsAReplay) {
  SequenceGuard guard;
  guard.judge(sample(9, 5, 100));

  EXPECT_EQ(guard.judge(sample(9, 5, 101)), Verdict::kBackward);
  EXPECT_EQ(guard.judge(sample(9, 4, 102)), Verdict::kBackward);
  EXPECT_EQ(guard.judge(sample(9, 6, 103)), Verdict::kNext);
}

TEST(SequenceGuard, ALargerNumberFromAnEarlierTimeIsRefused) {
  SequenceGuard guard;
  guard.judge(sample(9, 5, 100));

  EXPECT_EQ(guard.judge(sample(9, 6, 99)), Verdict::kBackward);
}

TEST(SequenceGuard, ARestartBeginsAtOneAgainAndIsAccepted) {
  SequenceGuard guard;
  guard.judge(sample(9, 5000, 100));

  EXPECT_EQ(guard.judge(sample(8, 1, 200)), Verdict::kRestart);
  EXPECT_EQ(guard.lost_before(), 0U);
  EXPECT_EQ(guard.judge(sample(8, 2, 201)), Verdict::kNext);
}

TEST(SequenceGuard, AStartThatEndedNeverComesBack) {
  SequenceGuard guard;
  guard.judge(sample(9, 5000, 100));
  guard.judge(sample(8, 1, 200));

  EXPECT_EQ(guard.judge(sample(9, 5001, 300)), Verdict::kBackward);
}

TEST(SequenceGuard, ARestartAfterTheClockWasSetBackIsKnownByItsNewWriter) {
  SequenceGuard guard;
  guard.judge(sample(9, 5000, 1000));
  SampleOrigin restarted = sample(8, 1, 100);
  restarted.writer = 77;

  EXPECT_EQ(guard.judge(restarted), Verdict::kRestart);
}

TEST(SequenceGuard, AnUnknownStartFromThePastIsAReplayNotARestart) {
  SequenceGuard guard;
  guard.judge(sample(9, 5, 100));

  EXPECT_EQ(guard.judge(sample(7, 1, 50)), Verdict::kBackward);
}

TEST(SequenceGuard, ARestartedHostMayBeginItsMonotonicClockAgain) {
  SequenceGuard guard;
  guard.judge(
      {.daemon_start = 9, .sequence_number = 5, .publish_monotonic_ns = 1000, .publish_time_ns = 1000});

  const SampleOrigin after_reboot{
      .daemon_start = 8, .sequence_number = 1, .publish_monotonic_ns = 10, .publish_time_ns = 2000};

  EXPECT_EQ(guard.judge(after_reboot), Verdict::kRestart);
}

}  // namespace
}  // namespace tubed
