// A session that never waits: it is run when bytes have come, or when it has said that something is due.
#include <gtest/gtest.h>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed::aurora {
namespace {

using Event = Session::Event;

struct SessionThatNeverWaits : testing::Test {
  SessionThatNeverWaits() { bench.pace = Pace::kWhenDue; }
  SessionBench bench;
};

TEST_F(SessionThatNeverWaits, MeasuresAsOneThatWaitsItself) {
  SessionBench waiting;
  for (SessionBench* each : {&waiting, &bench}) {
    ASSERT_TRUE(each->start());
    each->run_for(seconds(20));
    EXPECT_EQ(each->wrong, 0U);
    EXPECT_EQ(each->max_gap_frames, 0U);
  }
  EXPECT_NEAR(static_cast<double>(bench.measurements), static_cast<double>(waiting.measurements), 1);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95),
            percentile_of_absolute(waiting.time_errors_ms, 0.95) + 0.5);
  EXPECT_LT(percentile_of_absolute(bench.ages_ms, 0.95), percentile_of_absolute(waiting.ages_ms, 0.95) + 0.5);
}

TEST_F(SessionThatNeverWaits, IsNotRunWithoutAReason) {
  ASSERT_TRUE(bench.start());
  const std::uint64_t before = bench.runs;
  bench.run_for(seconds(10));
  EXPECT_LT(bench.runs - before, 10U * 40U * 40U)
      << "40 replies a second, of 20 portions of a millisecond each";
}

TEST_F(SessionThatNeverWaits, DoesNothingBeforeItIsDueWithoutAByte) {
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(2));
  for (int i = 0; i < 200; ++i) {
    while (bench.session.exchange().pending() || bench.session.due() <= bench.line.time + milliseconds(1)) {
      bench.run_for(milliseconds(1));
    }
    const std::uint64_t polls = bench.session.poller().counts().polls;
    ASSERT_EQ(bench.session.run(bench.line.time, bench.frame), Event::kQuiet);
    ASSERT_EQ(bench.session.poller().counts().polls, polls) << "it asked before it said that it would";
    bench.line.time = bench.session.due();
    ASSERT_EQ(bench.session.run(bench.line.time, bench.frame), Event::kQuiet);
    ASSERT_EQ(bench.session.poller().counts().polls, polls + 1);
  }
}

TEST_F(SessionThatNeverWaits, FindsATrackerThatWasWithoutPower) {
  ASSERT_TRUE(bench.start());
  bench.device.power_cycle(bench.line.time, seconds(3));
  bench.run_for(seconds(20));
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_EQ(bench.session.counts().tracking_starts, 2U);
}

TEST_F(SessionThatNeverWaits, SaysThatNobodyAnswers) {
  bench.device.power_cycle(bench.line.time, seconds(120));
  bench.session.attach(bench.line);
  ASSERT_TRUE(bench.run_until(Event::kProblem));
  EXPECT_NE(bench.problems.front().find("does not answer at any rate"), std::string::npos);
}

}  // namespace
}  // namespace tubed::aurora
