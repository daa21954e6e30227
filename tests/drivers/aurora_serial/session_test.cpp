// A session with the emulated Aurora, in virtual time.
#include "drivers/aurora/session.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed::aurora {
namespace {

using Event = Session::Event;

emulator::DeviceSettings quick() {
  emulator::DeviceSettings settings;
  settings.durations.tstart = milliseconds(200);
  return settings;
}

SessionSettings at(BaudRate rate) {
  SessionSettings settings;
  settings.baud = rate;
  return settings;
}

/// Leaves the tracker as a client does that is killed: at `rate`, its coils enabled, tracking or not.
void leave_behind(SessionBench& bench, int rate, bool tracking) {
  const auto say = [&](const CommandLine& command) {
    bench.device.receive(command.bytes(), bench.line.rate, bench.line.time);
    bench.line.time += seconds(3);
    std::vector<std::uint8_t> reply;
    bench.device.transmit(bench.line.time, bench.line.rate, reply);
    return reply;
  };
  bench.line.time += seconds(3);
  say(init_command());
  say(comm_command({.rate = baud_rate(rate).value()}));
  bench.line.rate = rate;
  if (tracking) {
    say(pinit_command(0x0A));
    say(pena_command(0x0A, TrackingPriority::kDynamic));
    ASSERT_EQ(as_text(say(tstart_command())), "OKAYA896\r");
  }
}

TEST(Session, FindsAFreshTrackerAndMeasuresAllCoils) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  EXPECT_EQ(bench.frame.coil_count, 5);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_EQ(bench.line.rate, 115200);
  EXPECT_TRUE(bench.problems.empty());
  EXPECT_EQ(bench.session.firmware(), "AURORA Rev 008");
  EXPECT_EQ(bench.session.api_revision()->family, 'D');
}

// What it asks without need, as which firmware it talks to, must not keep it from measuring.
TEST(Session, MeasuresHalfASecondAfterTheTrackerCouldHave) {
  SessionBench bench;
  const emulator::Durations& needs = emulator::DeviceSettings{}.durations;
  const MonotonicTime switched_on = bench.line.time;
  ASSERT_TRUE(bench.start());
  EXPECT_LT(bench.line.time - switched_on,
            needs.reset + needs.init + 3 * needs.pinit + needs.tstart + milliseconds(500));
  EXPECT_FALSE(bench.session.identity().firmware.empty());
}

TEST(Session, SaysThatAnEmulatedTrackersMeasurementsAreSimulated) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  EXPECT_EQ(bench.frame.origin, Origin::kSimulated);
}

TEST(Session, TellsCoilsApartByPortAndChannelNotByHandle) {
  CoilMap map;  // handles come in the order 1.0 2.0 3.0 1.1 2.1
  map.place(1, {3, 0});
  map.place(2, {1, 1});
  map.place(4, {2, 0});
  emulator::DeviceSettings device;
  device.plugs = {{1, {7, 2}, 1}, {2, {4, 6}, 2}, {3, {1}, 3}};
  SessionBench bench(device, {}, map);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(1));
  EXPECT_EQ(bench.status(1), CoilStatus::kOk);
  EXPECT_EQ(bench.status(2), CoilStatus::kOk);
  EXPECT_EQ(bench.status(3), CoilStatus::kDisabled);
  EXPECT_EQ(bench.status(4), CoilStatus::kOk);
  EXPECT_EQ(bench.wrong, 0U);
}

class SessionAtRate : public testing::TestWithParam<int> {};

TEST_P(SessionAtRate, KeepsFortyHertzAndLosesNothing) {
  SessionBench bench({}, at(baud_rate(GetParam()).value()));
  ASSERT_TRUE(bench.start());
  const auto before = bench.measurements;
  bench.run_for(seconds(60));
  EXPECT_EQ(bench.line.rate, GetParam());
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 2400, 2);
  EXPECT_EQ(bench.max_gap_frames, 0U);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95), 1.0);
  // The reply's time on the line, the tracker's thinking, and what the last portion waits.
  const double wire_ms = 221 * 10e3 / GetParam();
  EXPECT_LT(percentile_of_absolute(bench.ages_ms, 0.5), wire_ms + 3);
}

INSTANTIATE_TEST_SUITE_P(All, SessionAtRate, testing::Values(115200, 230400, 921600));

class SessionLeftBehind : public testing::TestWithParam<std::tuple<int, bool, bool>> {};

TEST_P(SessionLeftBehind, FindsATrackerThatAKilledClientLeftAtAnyRate) {
  const auto [rate, tracking, carries_breaks] = GetParam();
  SessionBench bench(quick());
  bench.line.carries_breaks = carries_breaks;
  leave_behind(bench, rate, tracking);
  bench.line.rate = 9600;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(1));
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.line.rate, 115200);
  EXPECT_TRUE(bench.problems.empty());
}

INSTANTIATE_TEST_SUITE_P(All, SessionLeftBehind,
                         testing::Combine(testing::Values(9600, 14400, 19200, 38400, 57600, 115200, 230400,
                                                          921600),
                                          testing::Bool(), testing::Bool()));

TEST(Session, UsesTheNextSlowerRateWhenTheTrackerRefusesOne) {
  emulator::DeviceSettings device;
  device.firmware = emulator::Firmware::kOld;
  SessionBench bench(device, at(BaudRate::k921600));
  ASSERT_TRUE(bench.start());
  EXPECT_EQ(bench.line.rate, 115200);
}

TEST(Session, AsksForNoRateThatTheHostDoesNotHave) {
  SessionBench bench({}, at(BaudRate::k921600));
  bench.line.fastest = 230400;
  ASSERT_TRUE(bench.start());
  EXPECT_EQ(bench.line.rate, 230400);
  EXPECT_EQ(bench.line.breaks, 1);  // only while the tracker was still starting
}

TEST(Session, SaysSoWhenNothingAnswersAndFindsTheTrackerWhenItIsSwitchedOn) {
  SessionBench bench(quick());
  bench.device.power_cycle(bench.line.time, seconds(40));
  bench.session.attach(bench.line);
  ASSERT_TRUE(bench.run_until(Event::kProblem));
  EXPECT_NE(bench.problems.back().find("does not answer at any rate"), std::string::npos);
  ASSERT_TRUE(bench.run_until(Event::kMeasurement));
  // After the word RESET: at most one round of the other rates, then ports and TSTART.
  EXPECT_LT(seconds_between(bench.device.ready(), bench.line.time), 4.0);
}

TEST(Session, ClosesWithTheLineAsTheNextClientExpectsIt) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.session.close();
  EXPECT_FALSE(bench.device.tracking());
  EXPECT_EQ(bench.device.link(), LinkParameters{});
  EXPECT_EQ(bench.session.run(bench.line.time + seconds(1), bench.frame), Event::kGone);
}

TEST(Session, ClosesInTimeWhenNobodyAnswers) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.device.power_cycle(bench.line.time, seconds(100));
  const MonotonicTime before = bench.line.time;
  bench.session.close();
  EXPECT_LT(seconds_between(before, bench.line.time), 1.6);
}

TEST(Session, SaysThatTheChannelHasGone) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.device.hang_up(bench.line.time, seconds(5));
  EXPECT_TRUE(bench.run_until(Event::kGone, milliseconds(100)));
  bench.session.close();
}

TEST(Session, FindsATrackerThatLostItsPowerWhileTracking) {
  for (int i = 0; i < 100; ++i) {
    SessionBench bench(quick());
    ASSERT_TRUE(bench.start());
    bench.run_for(milliseconds(500 + 37 * i));
    bench.device.power_cycle(bench.line.time, milliseconds(300 + 171 * i));
    ASSERT_TRUE(bench.run_until(Event::kRefused, milliseconds(100)));
    ASSERT_TRUE(bench.run_until(Event::kMeasurement)) << i;
    // INIT, COMM, three PINIT, PHINF, TSTART: 1.3 s; the search is at the other rate for 0.2 s, twice at
    // most.
    EXPECT_LT(seconds_between(bench.device.ready(), bench.line.time), 1.75) << i;
    EXPECT_EQ(bench.wrong, 0U);
  }
}

TEST(Session, GoesOnWithTheOthersWhenAPlugIsPulled) {
  SessionBench bench(quick());
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(2));
  const auto before = bench.measurements;
  ASSERT_TRUE(bench.device.ports().pull_out(2));
  bench.run_for(milliseconds(100));
  EXPECT_EQ(bench.status(3), CoilStatus::kDisabled);
  EXPECT_EQ(bench.status(4), CoilStatus::kDisabled);
  EXPECT_EQ(bench.session.missing().text(), "port 2: the tool was unplugged; sensor 3, 4 left out");
  EXPECT_EQ(bench.coils_seen(), 3);
  bench.run_for(seconds(10));
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 404, 2);
  EXPECT_EQ(bench.max_gap_frames, 0U);
}

TEST(Session, TakesAPlugThatIsPutInAgain) {
  for (int i = 0; i < 100; ++i) {
    SessionBench bench(quick());
    ASSERT_TRUE(bench.start());
    bench.run_for(seconds(1));
    ASSERT_TRUE(bench.device.ports().pull_out(1 + i % 3));
    bench.run_for(milliseconds(100 + 33 * i));
    ASSERT_TRUE(bench.device.ports().plug_in(1 + i % 3));
    const MonotonicTime plugged_in = bench.line.time;
    while (bench.coils_seen() < 5 && bench.line.time < plugged_in + seconds(20)) {
      bench.run_until(Event::kMeasurement);
    }
    // TSTOP 0.34 s, PINIT 0.14 s, TSTART 0.2 s, and the questions between.
    EXPECT_LT(seconds_between(plugged_in, bench.line.time), 1.2) << i;
    EXPECT_EQ(bench.wrong, 0U);
    EXPECT_TRUE(bench.session.missing().empty());
  }
}

TEST(Session, DoesNotStopTrackingForAPlugThatNobodyUses) {
  emulator::DeviceSettings device;
  device.plugs.push_back({9, {6}, 9});
  SessionBench bench(device);
  bench.device.ports().pull_out(9);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(1));
  bench.device.ports().plug_in(9);
  bench.run_for(seconds(5));
  EXPECT_EQ(bench.max_gap_frames, 0U);
  EXPECT_EQ(bench.session.counts().port_setups, 1U);
}

TEST(Session, WaitsForAPlugWhenAllAreOut) {
  SessionBench bench(quick());
  for (const int port : {1, 2, 3}) {
    bench.device.ports().pull_out(port);
  }
  bench.session.attach(bench.line);
  ASSERT_TRUE(bench.run_until(Event::kProblem));
  EXPECT_EQ(bench.problems.back(),
            "port 1: no tool; sensor 1, 2 left out; port 2: no tool; sensor 3, 4 left out; port 3: no tool; "
            "sensor 5 left out");
  bench.run_for(seconds(10));
  EXPECT_EQ(bench.problems.size(), 1U);
  bench.device.ports().plug_in(2);
  ASSERT_TRUE(bench.run_until(Event::kMeasurement, seconds(3)));
  EXPECT_EQ(bench.coils_seen(), 2);
}

TEST(Session, NamesWhatIsMissingAndWhatIsPluggedInInstead) {
  CoilMap map;
  map.place(1, {1, 0});
  map.place(2, {4, 1});
  SessionBench bench(quick(), {}, map);
  ASSERT_TRUE(bench.start());
  ASSERT_EQ(bench.problems.size(), 1U);
  EXPECT_EQ(bench.problems[0], "port 4: no tool; sensor 2 left out");
  EXPECT_EQ(
      bench.session.describe().text(),
      "port 4: no tool; sensor 2 left out; not in the configuration, not tracked: port 2 channel 0, port 3 "
      "channel 0, port 1 channel 1, port 2 channel 1");
  EXPECT_EQ(bench.status(1), CoilStatus::kOk);
  EXPECT_EQ(bench.status(2), CoilStatus::kDisabled);
}

TEST(Session, LeavesOutAToolThatCannotBeInitialised) {
  emulator::DeviceSettings device = quick();
  device.durations.pinit = milliseconds(2500);
  device.plugs[1].memory = emulator::ToolMemory::kBlank;
  SessionBench bench(device);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(1));
  EXPECT_EQ(bench.coils_seen(), 3);
  EXPECT_EQ(bench.wrong, 0U);
  ASSERT_EQ(bench.problems.size(), 1U);
  EXPECT_TRUE(bench.problems[0].starts_with("port 2: ERROR13, cannot initialise")) << bench.problems[0];
  EXPECT_TRUE(bench.problems[0].ends_with("sensor 3, 4 left out")) << bench.problems[0];
}

TEST(Session, WritesTheToolDefinitionOfAToolWithoutMemory) {
  const std::vector<std::uint8_t> rom(1024, 0x5A);
  emulator::DeviceSettings device = quick();
  device.plugs[1].memory = emulator::ToolMemory::kBlank;
  SessionBench bench(device, {}, two_a_port(5), {{2, rom}});
  ASSERT_TRUE(bench.start());
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_TRUE(bench.problems.empty());
}

// What a firmware does that does not know BX, or falls over it.
class SessionWithoutBinary : public testing::TestWithParam<const char*> {};

TEST_P(SessionWithoutBinary, FallsBackToText) {
  SessionBench bench(quick());
  bench.line.replace = {"BX:", GetParam()};
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  EXPECT_TRUE(bench.session.poller().encoding().uses_text());
  EXPECT_EQ(bench.session.poller().counts().tx_fallbacks, 1U);
  const auto before = bench.measurements;
  bench.run_for(seconds(5));
  EXPECT_GT(bench.measurements - before, 140U);  // 33 ms a reply: every measurement or every second one
  EXPECT_EQ(bench.wrong, 0U);
}

INSTANTIATE_TEST_SUITE_P(All, SessionWithoutBinary, testing::Values("BQ:", ""));

TEST(Session, ReturnsToBinaryWhenThatWorksAgain) {
  SessionBench bench(quick());
  bench.line.replace = {"BX:", ""};
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  ASSERT_TRUE(bench.session.poller().encoding().uses_text());
  bench.line.replace = {};
  bench.run_for(seconds(30));
  EXPECT_FALSE(bench.session.poller().encoding().uses_text());
}

TEST(Session, SurvivesTheWrapOfTheFrameCounter) {
  emulator::DeviceSettings device = quick();
  device.first_frame = 0xFFFFFFFFU - 8 * 40 * 10;
  SessionBench bench(device);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(30));
  EXPECT_EQ(bench.max_gap_frames, 0U);
  EXPECT_EQ(bench.wrong, 0U);
}

TEST(Session, StartsTrackingAgainWhenTheTrackerWasStoppedByAnother) {
  SessionBench bench(quick());
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(1));
  bench.device.receive(tstop_command().bytes(), 115200, bench.line.time);
  bench.run_for(seconds(3));
  EXPECT_TRUE(bench.run_until(Event::kMeasurement, milliseconds(100)));
  EXPECT_EQ(bench.session.counts().tracking_starts, 2U);
}

TEST(Session, FollowsATrackerWhoseClockIsOnePercentFast) {
  emulator::DeviceSettings device = quick();
  device.rate_hz = 40.4;  // as recorded
  SessionBench bench(device);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(60));
  EXPECT_EQ(bench.max_gap_frames, 0U);
  EXPECT_NEAR(bench.session.poller().clock().period_ns(), 1e9 / 40.4, 1e3);
}

TEST(Session, FollowsATrackerThatMeasuresSixtySixTimesASecond) {
  emulator::DeviceSettings device = quick();
  device.rate_hz = 66;
  SessionBench bench(device, at(BaudRate::k230400));
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  const auto before = bench.measurements;
  bench.run_for(seconds(60));
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 3960, 10);
  EXPECT_EQ(bench.wrong, 0U);
}

TEST(Session, KeepsTheWireTraceOfWhatHappened) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  std::vector<std::string> sent;
  bench.session.trace().each([&](const WireRecord& record) {
    if (record.event == WireEvent::kSent) {
      sent.emplace_back(as_text(record.bytes));
    }
  });
  EXPECT_EQ(sent.front(), "INIT:E3A5\r");
  EXPECT_NE(std::find(sent.begin(), sent.end(), "TSTART:5423\r"), sent.end());
  EXPECT_EQ(sent.back().substr(0, 3), "BX:");
}

}  // namespace
}  // namespace tubed::aurora
