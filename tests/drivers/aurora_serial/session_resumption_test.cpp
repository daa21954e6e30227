// What a session does when the line comes back: the tracker went on, or it did not.
#include <gtest/gtest.h>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed::aurora {
namespace {

using Event = Session::Event;

/// Tracks for two seconds, then the cable is out for so long; it is back when this returns.
void pull_cable(SessionBench& bench, std::chrono::nanoseconds time) {
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(2));
  bench.device.hang_up(bench.line.time, time);
  ASSERT_TRUE(bench.run_until(Event::kGone, milliseconds(100)));
  bench.line.time += time;
  bench.line.rate = 9600;  // as every port that is opened
}

/// Seconds from now to the next measurement.
double until_measured(SessionBench& bench) {
  const MonotonicTime before = bench.line.time;
  bench.time_errors_ms.clear();
  bench.session.attach(bench.line);
  return bench.run_until(Event::kMeasurement) ? seconds_between(before, bench.line.time) : 60;
}

class SessionAfterCable : public testing::TestWithParam<milliseconds> {};

TEST_P(SessionAfterCable, GoesOnAtOnceWithWhatItTracked) {
  SessionBench bench;
  pull_cable(bench, GetParam());
  EXPECT_LT(until_measured(bench), 0.15);
  bench.run_for(seconds(5));
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_EQ(bench.session.counts().resumptions, 1U);
  EXPECT_EQ(bench.session.counts().tracking_starts, 1U);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95), 3.0);
  EXPECT_TRUE(bench.problems.empty());
}

INSTANTIATE_TEST_SUITE_P(All, SessionAfterCable,
                         testing::Values(milliseconds(50), milliseconds(700), milliseconds(10'000),
                                         milliseconds(600'000)));

TEST(SessionAfterCable, BeginsAnewWhenAToolWasTakenOutMeanwhile) {
  SessionBench bench;
  pull_cable(bench, seconds(3));
  ASSERT_TRUE(bench.device.ports().pull_out(2));
  ASSERT_TRUE(bench.device.ports().plug_in(2));
  EXPECT_LT(until_measured(bench), 4);
  EXPECT_EQ(bench.session.counts().resumptions, 0U);
  bench.run_for(seconds(1));
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.wrong, 0U);
}

TEST(SessionAfterCable, BeginsAnewWhenTheTrackerWasWithoutPowerMeanwhile) {
  SessionBench bench;
  pull_cable(bench, seconds(5));
  bench.device.power_cycle(bench.line.time - seconds(4), seconds(1));
  EXPECT_LT(until_measured(bench), 4);
  EXPECT_EQ(bench.session.counts().tracking_starts, 2U);
  EXPECT_EQ(bench.wrong, 0U);
}

TEST(SessionAfterCable, BeginsAnewWhenTheTrackerWasStoppedMeanwhile) {
  SessionBench bench;
  pull_cable(bench, seconds(3));
  bench.device.receive(tstop_command().bytes(), 115200, bench.line.time);
  bench.line.time += seconds(1);
  EXPECT_LT(until_measured(bench), 4);
  EXPECT_EQ(bench.session.counts().tracking_starts, 2U);
  EXPECT_EQ(bench.wrong, 0U);
}

// The port stays, as when the cable is pulled at the tracker's end of an adapter.
TEST(SessionAfterCable, GoesOnAtOnceWhenTheTrackerWasOnlySilent) {
  for (int i = 1; i <= 60; ++i) {
    SessionBench bench;
    ASSERT_TRUE(bench.start());
    bench.device.faults().set(emulator::Fault::kNoReply, {.probability = 1, .scope = emulator::Scope::kAny});
    bench.run_for(i * milliseconds(113));
    bench.device.faults().clear();
    const MonotonicTime back = bench.line.time;
    ASSERT_TRUE(bench.run_until(Event::kMeasurement));
    EXPECT_LT(seconds_between(back, bench.line.time), 0.7) << i;
    EXPECT_EQ(bench.session.counts().tracking_starts, 1U) << i;
    EXPECT_EQ(bench.wrong, 0U);
  }
}

TEST(SessionAfterCable, DoesNotAskForWhatItStoppedItself) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.session.close();
  bench.line.rate = 9600;
  EXPECT_LT(until_measured(bench), 4);
  EXPECT_EQ(bench.session.counts().tracking_starts, 2U);
}

// The program was stopped, or the machine it runs on: the tracker went on. Whatever the poll was doing.
TEST(SessionAfterOwnAbsence, GoesOnAtOnceWithWhatItTracked) {
  for (const milliseconds absent : {milliseconds(300), milliseconds(1200), milliseconds(3000)}) {
    for (int phase_ms = 0; phase_ms < 25; ++phase_ms) {
      SessionBench bench;
      ASSERT_TRUE(bench.start());
      bench.run_for(seconds(2) + milliseconds(phase_ms));
      bench.line.time += absent;
      const MonotonicTime back = bench.line.time;
      ASSERT_TRUE(bench.run_until(Event::kMeasurement));
      EXPECT_LT(seconds_between(back, bench.line.time), 0.1) << phase_ms;
      bench.run_for(seconds(2));
      EXPECT_EQ(bench.session.counts().tracking_starts, 1U) << phase_ms;
      EXPECT_EQ(bench.wrong, 0U);
      EXPECT_TRUE(bench.problems.empty());
    }
  }
}

}  // namespace
}  // namespace tubed::aurora
