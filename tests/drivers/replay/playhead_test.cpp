#include "drivers/replay/playhead.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr MonotonicTime kStart = from_ns(5'000'000'000);

Playhead three_rows(ReplayEnd end) {
  Playhead playhead({milliseconds(0), milliseconds(100), milliseconds(200)}, milliseconds(300), end);
  playhead.begin(kStart, kStart);
  return playhead;
}

TEST(Playhead, RowsAreDueAtStartPlusTheirTimeAndThenItEnds) {
  Playhead playhead = three_rows(ReplayEnd::kStops);
  for (const int expected_ms : {0, 100, 200}) {
    ASSERT_FALSE(playhead.ended());
    EXPECT_EQ(playhead.due(), kStart + milliseconds(expected_ms));
    playhead.advance();
  }
  EXPECT_TRUE(playhead.ended());
}

TEST(Playhead, LoopingTimesGoOnGrowing) {
  Playhead playhead = three_rows(ReplayEnd::kLoops);
  for (const int expected_ms : {0, 100, 200, 300, 400, 500, 600}) {
    EXPECT_EQ(playhead.due(), kStart + milliseconds(expected_ms));
    playhead.advance();
  }
  EXPECT_EQ(playhead.lap(), 2U);
  EXPECT_EQ(playhead.row(), 1U);
}

TEST(Playhead, ALateReaderIsTakenToTheNewestRowDue) {
  Playhead playhead = three_rows(ReplayEnd::kLoops);

  playhead.skip_overtaken(kStart + milliseconds(450));

  EXPECT_EQ(playhead.due(), kStart + milliseconds(400));
}

TEST(Playhead, TheLastRowIsNotSkippedWhenNothingFollows) {
  Playhead playhead = three_rows(ReplayEnd::kStops);

  playhead.skip_overtaken(kStart + milliseconds(10'000));

  EXPECT_EQ(playhead.due(), kStart + milliseconds(200));
}

TEST(Playhead, LoopingFromAStartLongAgoJoinsTheLapThatRuns) {
  Playhead playhead({milliseconds(0), milliseconds(100)}, milliseconds(200), ReplayEnd::kLoops);

  playhead.begin(kStart, kStart + milliseconds(1150));

  EXPECT_EQ(playhead.due(), kStart + milliseconds(1000));
}

TEST(Playhead, WithoutRowsItHasEnded) {
  Playhead playhead({}, milliseconds(1), ReplayEnd::kLoops);
  playhead.begin(kStart, kStart + milliseconds(50));
  EXPECT_TRUE(playhead.ended());
}

}  // namespace
}  // namespace tubed
