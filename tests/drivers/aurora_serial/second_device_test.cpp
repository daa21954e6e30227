// The session against a device of other hands: every fault, and what a real tracker does on its first day.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "tests/drivers/aurora_serial/second_bench.hpp"

namespace tubed::aurora {
namespace {

using second_aurora::Fault;
using second_aurora::FaultKind;
using second_aurora::kFaultKinds;
using second_aurora::kFaultNames;
using second_aurora::Rom;
using second_aurora::Settings;
using second_aurora::Tool;

constexpr double kMaxStaleMs = 20;  ///< no pose is older than its time says by more

/// Ten seconds at the device's full rate.
void expect_full_rate(SecondBench& bench) {
  bench.run_for(seconds(2));
  const auto before = bench.measurements;
  const auto starts = bench.session.counts().tracking_starts;
  bench.run_for(seconds(10));
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 404, 5);
  EXPECT_EQ(bench.session.counts().tracking_starts, starts);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LE(bench.oldest_ms, kMaxStaleMs);
}

TEST(SecondDevice, IsMeasuredAtItsFullRateWithEveryCoil) {
  SecondBench bench;
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_TRUE(bench.session.describe().empty()) << bench.session.describe().text();
  EXPECT_EQ(bench.session.firmware(), "AURORA Rev 006");
  EXPECT_EQ(bench.session.identity().tool_count, 3);
  EXPECT_FALSE(bench.session.identity().control_unit_serial.empty());
  EXPECT_FALSE(bench.session.identity().field_generator.empty());
}

class SecondDeviceAtRate : public testing::TestWithParam<BaudRate> {};

TEST_P(SecondDeviceAtRate, IsMeasuredAtItsFullRate) {
  SecondBench bench(second_settings(), two_a_port(5), {}, GetParam());
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
}

INSTANTIATE_TEST_SUITE_P(All, SecondDeviceAtRate,
                         testing::Values(BaudRate::k115200, BaudRate::k230400, BaudRate::k921600));

TEST(SecondDevice, AToolThatIsNotConfiguredStopsNothing) {
  Settings settings = second_settings();
  settings.ports[3] = Tool{};
  SecondBench bench(settings);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.session.describe().text(), "not in the configuration, not tracked: port 4 channel 0");
}

TEST(SecondDevice, AnUnusedChannelStopsNothing) {
  Settings settings = second_settings();
  settings.ports[2]->coils = 2;
  SecondBench bench(settings);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.session.describe().text(), "not in the configuration, not tracked: port 3 channel 1");
}

TEST(SecondDevice, AToolThatCannotBeInitialisedStopsNothingAndIsNamedFirst) {
  Settings settings = second_settings();
  settings.ports[1]->rom = Rom::Unreadable;
  SecondBench bench(settings);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 3);
  EXPECT_TRUE(bench.session.describe().text().starts_with("port 2: ERROR13, cannot initialise"))
      << bench.session.describe().text();
}

TEST(SecondDevice, AStrangersToolPluggedInWhileTrackingStopsNothing) {
  SecondBench bench;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(2));
  Tool stranger;
  stranger.serial = 0x99990001;
  bench.device.plug(4, stranger, bench.now_ns());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_TRUE(bench.session.describe().text().starts_with("a tool was plugged in while tracking"))
      << bench.session.describe().text();
  EXPECT_LT(bench.max_gap, milliseconds(80));
}

TEST(SecondDevice, AShortDefinitionFileMakesABlankToolUsable) {
  const std::vector<std::uint8_t> rom(329, 0x5A);
  Settings settings = second_settings();
  settings.ports[1]->rom = Rom::Blank;
  SecondBench bench(settings, two_a_port(5), {{2, rom}});
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
}

TEST(SecondDevice, AToolThatIsPulledAndPutInAgainIsTrackedAgain) {
  const Settings settings = second_settings();
  SecondBench bench(settings);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(2));
  bench.device.unplug(2, bench.now_ns());
  bench.run_for(seconds(2));
  EXPECT_EQ(bench.coils_seen(), 3);
  EXPECT_EQ(bench.session.describe().text(), "port 2: the tool was unplugged; sensor 3, 4 left out");
  bench.device.plug(2, *settings.ports[1], bench.now_ns());
  bench.run_for(seconds(8));  // TSTOP, PINIT 2.55 s, TSTART
  EXPECT_EQ(bench.coils_seen(), 5);
  expect_full_rate(bench);
}

TEST(SecondDevice, SpeaksTextWhenItDoesNotKnowBx) {
  Settings settings = second_settings();
  settings.firmware.bx_error = 0x01;
  SecondBench bench(settings);
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(20));
  EXPECT_TRUE(bench.session.poller().encoding().uses_text());
  EXPECT_EQ(bench.session.poller().encoding().refusal(), 0x01);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LE(bench.oldest_ms, kMaxStaleMs);
}

/// Tracking replies of each case; TUBED_FAULT_REPLIES=1000000 for the table of drivers/aurora/README.md.
std::uint64_t replies_a_case() {
  const char* const wanted = std::getenv("TUBED_FAULT_REPLIES");
  return wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 10'000;
}

class SecondDeviceUnderFaults : public testing::TestWithParam<std::tuple<std::size_t, double>> {};

TEST_P(SecondDeviceUnderFaults, AcceptsNoWrongPoseAndNoneOlderThanItsTimeSays) {
  const auto [kind, probability] = GetParam();
  SecondBench bench;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  bench.device.strike({.kind = static_cast<FaultKind>(kind), .probability = probability}, bench.now_ns());
  const auto before = bench.measurements;
  const MonotonicTime began = bench.line.time;
  const std::uint64_t end = bench.device.counts().tracking_replies + replies_a_case();
  while (bench.device.counts().tracking_replies < end && bench.line.time < began + std::chrono::hours(10)) {
    bench.run_for(seconds(10));
  }
  const double measured = seconds_between(began, bench.line.time) * 40.4;
  std::printf(
      "%-18s %4.0f %%  struck %6lu  lost %6.2f %%  starts %4lu  wrong %lu  oldest %6.2f ms  earliest %7.2f "
      "ms\n",
      std::string(kFaultNames[kind]).c_str(), 100 * probability,
      bench.device.counts().of(static_cast<FaultKind>(kind)),
      100 * (1 - static_cast<double>(bench.measurements - before) / measured),
      bench.session.counts().tracking_starts, bench.wrong, bench.oldest_ms, bench.earliest_ms);
  EXPECT_GT(bench.device.counts().of(static_cast<FaultKind>(kind)), 0U);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LE(bench.oldest_ms, kMaxStaleMs);
  EXPECT_GE(bench.earliest_ms, -kMaxStaleMs);
  bench.device.strike_no_more(bench.now_ns());
  bench.run_for(seconds(40));
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
}

INSTANTIATE_TEST_SUITE_P(All, SecondDeviceUnderFaults,
                         testing::Combine(testing::Range(std::size_t{0}, kFaultKinds),
                                          testing::Values(0.01, 0.1)),
                         [](const auto& one) {
                           return std::string(kFaultNames[std::get<0>(one.param)]) +
                                  (std::get<1>(one.param) < 0.05 ? "_1" : "_10");
                         });

/// The tables of firmware that have been met: Rev 005, 006, 008; API D.001.004 to D.001.007; and where nobody
/// knows, both ways.
class SecondDeviceWithFirmware : public testing::TestWithParam<int> {};

TEST_P(SecondDeviceWithFirmware, IsMeasuredWithEveryCoil) {
  Settings settings = second_settings();
  second_aurora::Firmware& firmware = settings.firmware;
  const auto bit = [](int number) { return (GetParam() >> number & 1) != 0; };
  constexpr const char* kTags[] = {"AURORA Rev 005", "AURORA Rev 006", "AURORA Rev 008", "AURORA Rev 008"};
  constexpr const char* kRevisions[] = {"D.001.004", "D.001.005", "D.001.006", "D.001.007"};
  firmware.freeze_tag = kTags[GetParam() & 3];
  firmware.api_revision = kRevisions[GetParam() & 3];
  firmware.refused_rates = bit(2) ? "6A" : "";
  firmware.phinf_answers_while_tracking = bit(3);
  firmware.phinf_before_pinit_is_blank = bit(4);
  firmware.counter_stops_with_tstop = bit(2);
  firmware.init_frees_handles = bit(3);
  firmware.freed_numbers_are_reused = bit(4);
  firmware.plug_gets_handle_while_tracking = bit(5);
  firmware.works_ahead_while_sending = bit(5);
  firmware.handle_order = static_cast<second_aurora::HandleOrder>(GetParam() % 3);
  firmware.status_before_pinit = bit(4) ? 0x001 : 0x003;
  firmware.first_reply_is_missing = bit(3);
  settings.ports[3] = Tool{};
  SecondBench bench(settings, two_a_port(5), {}, BaudRate::k230400);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.session.firmware(), firmware.freeze_tag);
  // A tool is exchanged, the cable is pulled, the power fails.
  bench.device.unplug(2, bench.now_ns());
  bench.run_for(seconds(2));
  bench.device.plug(2, *settings.ports[1], bench.now_ns());
  bench.run_for(seconds(12));
  bench.device.hang_up(bench.now_ns(), second_aurora::kSecond_ns);
  bench.run_for(seconds(20));
  bench.device.power_cycle(bench.now_ns(), second_aurora::kSecond_ns);
  bench.run_for(seconds(30));
  EXPECT_EQ(bench.coils_seen(), 5) << bench.session.describe().text();
  expect_full_rate(bench);
}

INSTANTIATE_TEST_SUITE_P(All, SecondDeviceWithFirmware, testing::Range(0, 64));

}  // namespace
}  // namespace tubed::aurora
