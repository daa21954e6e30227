// What a real tracker does on its first day, and what a session makes of it: every handle is listed, tools
// are strangers, counters stand still.
#include <gtest/gtest.h>

#include <cstdlib>
#include <deque>
#include <utility>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed::aurora {
namespace {

using emulator::Fault;
using emulator::Plug;
using emulator::ToolMemory;
using Event = Session::Event;

constexpr double kMaxStaleMs = 20;  ///< no pose is older than its time says by more

emulator::DeviceSettings quick() {
  emulator::DeviceSettings settings;
  settings.durations.tstart = milliseconds(200);
  return settings;
}

/// Ten seconds at full rate, with nothing lost.
void expect_full_rate(SessionBench& bench) {
  bench.run_for(seconds(1));
  const auto before = bench.measurements;
  const auto starts = bench.session.counts().tracking_starts;
  bench.run_for(seconds(10));
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 400, 2);
  EXPECT_EQ(bench.session.counts().tracking_starts, starts);
  EXPECT_EQ(bench.wrong, 0U);
}

TEST(SessionFirstDay, AToolThatIsNotConfiguredStopsNothing) {
  emulator::DeviceSettings device = quick();
  device.plugs.push_back(Plug{.port = 4, .sensors = {6}, .serial_number = 4});
  SessionBench bench(device);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_TRUE(bench.problems.empty());
  EXPECT_EQ(bench.session.describe().text(), "not in the configuration, not tracked: port 4 channel 0");
}

TEST(SessionFirstDay, AnUnusedChannelStopsNothing) {
  CoilMap map = two_a_port(4);
  map.place(5, {3, 0});
  emulator::DeviceSettings device = quick();
  device.plugs[2].sensors = {5, 0};
  SessionBench bench(device, {}, map);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.session.describe().text(), "not in the configuration, not tracked: port 3 channel 1");
}

TEST(SessionFirstDay, AToolThatCannotBeInitialisedStopsNothingAndIsNamedFirst) {
  emulator::DeviceSettings device = quick();
  device.plugs[1].memory = ToolMemory::kBlank;
  SessionBench bench(device);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 3);
  EXPECT_EQ(bench.session.describe().text(),
            "port 2: ERROR13, cannot initialise the port handle: the tool's memory is unreadable or "
            "unprogrammed; sensor 3, 4 left out");
}

TEST(SessionFirstDay, AStrangersToolPluggedInWhileTrackingStopsNothing) {
  SessionBench bench(quick());
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(1));
  ASSERT_TRUE(bench.device.ports().plug_in_stranger(7, 0x99990001, "STRANGER"));
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_EQ(bench.session.describe().text(),
            "a tool was plugged in while tracking and is not tracked (handle 0F)");
  EXPECT_EQ(bench.max_gap_frames, 0U);
}

TEST(SessionFirstDay, AShortDefinitionFileMakesABlankToolUsable) {
  const std::vector<std::uint8_t> rom(329, 0x5A);  // genuine files are no longer
  emulator::DeviceSettings device = quick();
  device.plugs[1].memory = ToolMemory::kBlank;
  SessionBench bench(device, {}, two_a_port(5), {{2, rom}});
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 5);
  EXPECT_TRUE(bench.session.describe().empty()) << bench.session.describe().text();
  const emulator::ToolImage* const written = bench.device.ports().written(2);
  ASSERT_NE(written, nullptr);
  EXPECT_EQ(written->bytes[328], 0x5A);
  EXPECT_EQ(written->bytes[329], 0);
}

TEST(SessionFirstDay, AnotherCatheterInThePlugIsToldAndNotTracked) {
  CoilMap map = two_a_port(5);
  map.expect(3, {.serial_number = 0x12345678, .part_number = {}});
  map.expect(4, {.serial_number = 0x12345678, .part_number = {}});
  SessionBench bench(quick(), {}, map);
  ASSERT_TRUE(bench.start());
  expect_full_rate(bench);
  EXPECT_EQ(bench.coils_seen(), 3);
  EXPECT_EQ(
      bench.session.describe().text(),
      "port 2: tool 3C4B0002 (part 610029) is plugged in, tool 12345678 is configured; sensor 3, 4 left "
      "out");
}

TEST(SessionFirstDay, TellsWhatTheTrackerComplainsOf) {
  SessionBench bench(quick());
  ASSERT_TRUE(bench.start());
  bench.device.faults().conditions.raised.bits = 0x0200;
  bench.run_for(seconds(1));
  EXPECT_TRUE(bench.session.describe().text().starts_with("the tracker's temperature is out of range"));
  EXPECT_EQ(bench.coils_seen(), 5);
  bench.device.faults().conditions.raised.bits = 0;
  bench.run_for(seconds(1));
  EXPECT_TRUE(bench.session.describe().empty()) << bench.session.describe().text();
}

TEST(SessionFirstDay, AFrozenCounterGivesNoMeasurementOverAllTheRestarts) {
  SessionBench bench(quick());
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(3));
  bench.device.faults().set(Fault::kStandstill, {.next = 1});
  bench.run_for(seconds(1));
  const auto before = bench.measurements;
  const auto starts = bench.session.counts().tracking_starts;
  bench.run_for(milliseconds(10'500));
  EXPECT_EQ(bench.measurements, before);
  EXPECT_GE(bench.session.counts().tracking_starts, starts + 2);
  EXPECT_NE(bench.session.problem().text().find("frame counter stands still at"), std::string_view::npos)
      << bench.session.problem().text();
  bench.run_for(seconds(10));
  EXPECT_GT(bench.measurements, before + 100);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LE(max_of(bench.time_errors_ms), kMaxStaleMs);
}

/// Every way in which tracking begins again, at whatever instant of the standstill.
TEST(SessionFirstDay, NoRestartGivesAnOldPoseANewTime) {
  using Restart = void (*)(SessionBench&);
  constexpr Restart kRestarts[] = {
      [](SessionBench& bench) { bench.device.power_cycle(bench.line.time, milliseconds(500)); },
      [](SessionBench& bench) { bench.device.hang_up(bench.line.time, milliseconds(700)); },
      [](SessionBench& bench) { bench.device.receive_break(bench.line.time); },
      [](SessionBench& bench) {
        bench.device.receive(tstop_command().bytes(), bench.line.rate, bench.line.time);
      },
      [](SessionBench& bench) { bench.device.ports().pull_out(2); },
      [](SessionBench& bench) {
        bench.session.close(), bench.line.rate = 9600, bench.session.attach(bench.line);
      },
      [](SessionBench& bench) { bench.device.faults().set(Fault::kNoReply, {.next = 30}); },
  };
  for (const Restart& restart : kRestarts) {
    for (int delay_ms = 100; delay_ms < 6000; delay_ms += 700) {
      SessionBench bench(quick());
      ASSERT_TRUE(bench.start());
      bench.run_for(seconds(2) + milliseconds(delay_ms % 25));
      bench.device.faults().set(Fault::kStandstill, {.next = 1});
      bench.run_for(milliseconds(delay_ms));
      restart(bench);
      bench.run_for(seconds(25));
      EXPECT_EQ(bench.wrong, 0U) << delay_ms;
      EXPECT_LE(max_of(bench.time_errors_ms), kMaxStaleMs) << delay_ms;
      EXPECT_GT(bench.measurements, 200U) << delay_ms;
    }
  }
}

class SessionWithACounterThatFails : public testing::TestWithParam<std::tuple<Fault, double>> {};

TEST_P(SessionWithACounterThatFails, AcceptsNoWrongPoseAndNoneOlderThanItsTimeSays) {
  const auto [fault, probability] = GetParam();
  SessionBench bench(quick());
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  bench.device.faults().set(fault, {.probability = probability});
  const char* const wanted = std::getenv("TUBED_FAULT_REPLIES");
  const std::uint64_t replies = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 20'000;
  const std::uint64_t end = bench.device.counts().tracking_replies + replies;
  const MonotonicTime latest = bench.line.time + std::chrono::hours(10);
  while (bench.device.counts().tracking_replies < end && bench.line.time < latest) {
    bench.run_for(seconds(10));
  }
  std::printf("%-12s %4.1f %%  struck %6lu  measurements %8lu  starts %lu  wrong %lu  oldest %.2f ms\n",
              std::string(emulator::fault_name(fault)).c_str(), 100 * probability,
              bench.device.faults().struck(fault), bench.measurements, bench.session.counts().tracking_starts,
              bench.wrong, max_of(bench.time_errors_ms));
  EXPECT_GT(bench.device.faults().struck(fault), 5U);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LE(max_of(bench.time_errors_ms), kMaxStaleMs);
  bench.device.faults().clear();
  bench.run_for(seconds(30));
  expect_full_rate(bench);
}

INSTANTIATE_TEST_SUITE_P(All, SessionWithACounterThatFails,
                         testing::Combine(testing::Values(Fault::kStandstill, Fault::kCountBack,
                                                          Fault::kCountOn),
                                          testing::Values(0.001, 0.01)));

/// A line whose other end sends copies of old replies: every `every`th question has the reply of `back`
/// questions ago at once, and its own as well or not.
class CopyingLine final : public ByteChannel {
 public:
  CopyingLine(EmulatedLine& line, int every, std::size_t back, bool also_answers)
      : line_(line), every_(every), back_(back), also_answers_(also_answers) {}

  bool copies = false;

  MonotonicTime now() noexcept override { return line_.time; }
  bool write(Bytes bytes) noexcept override {
    if (!as_text(bytes).starts_with("BX")) {
      return line_.write(bytes);
    }
    replies_.push_back(std::exchange(newest_, {}));
    if (!copies || ++questions_ % every_ != 0 || replies_.size() < back_) {
      return line_.write(bytes);
    }
    copy_ = replies_[replies_.size() - back_];
    return !also_answers_ || line_.write(bytes);
  }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    if (!copy_.empty() && deadline > line_.time + milliseconds(2)) {
      line_.time += milliseconds(2);
      const std::size_t size = copy_.size();
      std::copy(copy_.begin(), copy_.end(), room.begin());
      copy_.clear();
      return {size, false};
    }
    const Arrival arrival = line_.read(room, deadline);
    newest_.insert(newest_.end(), room.begin(), room.begin() + static_cast<std::ptrdiff_t>(arrival.size));
    return arrival;
  }
  bool knows_baud(int bits_per_second) noexcept override { return line_.knows_baud(bits_per_second); }
  bool set_baud(int bits_per_second) noexcept override { return line_.set_baud(bits_per_second); }
  bool send_break() noexcept override { return line_.send_break(); }

 private:
  EmulatedLine& line_;
  int every_;
  std::size_t back_;
  bool also_answers_;
  int questions_ = 0;
  std::vector<std::uint8_t> newest_;
  std::vector<std::uint8_t> copy_;
  std::deque<std::vector<std::uint8_t>> replies_;
};

class SessionWithCopies : public testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(SessionWithCopies, NeverHandsOnAnOldMeasurementAndKeepsItsTimes) {
  const auto [back, also_answers] = GetParam();
  SessionBench bench(quick());
  CopyingLine line(bench.line, 10, static_cast<std::size_t>(back), also_answers);
  bench.session.attach(line);
  ASSERT_TRUE(bench.run_until(Event::kMeasurement));
  bench.run_for(seconds(10));
  line.copies = true;
  bench.time_errors_ms.clear();
  const auto before = bench.measurements;
  std::uint32_t last = bench.frame.tracker_frame;
  const MonotonicTime end = bench.line.time + seconds(120);
  while (bench.line.time < end && bench.run_until(Event::kMeasurement, seconds(1))) {
    ASSERT_GT(static_cast<std::int32_t>(bench.frame.tracker_frame - last), 0);
    last = bench.frame.tracker_frame;
  }
  EXPECT_GT(bench.measurements - before, 120U * 30);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95), 3.5);
  EXPECT_LE(max_of(bench.time_errors_ms), kMaxStaleMs / 2);
  EXPECT_EQ(bench.session.counts().tracking_starts, 1U);
}

INSTANTIATE_TEST_SUITE_P(All, SessionWithCopies, testing::Combine(testing::Values(1, 5), testing::Bool()));

TEST(SessionFirstDay, TakesWhatItCanOfATrackerThatGoesOnListingOtherHandlesAndSaysSo) {
  // A handle that cannot be disabled: PDIS is lost on the way.
  emulator::DeviceSettings device = quick();
  device.plugs.push_back(Plug{.port = 4, .sensors = {6}, .serial_number = 4});
  SessionBench bench(device);
  ASSERT_TRUE(bench.start());
  for (const emulator::PortHandle& handle : bench.device.ports().all()) {
    if (bench.device.ports().plug(handle).port == 4) {
      ASSERT_EQ(bench.device.ports().enable(handle.number), emulator::Error::kNone);
    }
  }
  bench.line.replace = {"PDIS:", "XDIS:"};
  bench.run_for(seconds(10));
  const auto before = bench.measurements;
  bench.run_for(seconds(10));
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 400, 60);
  EXPECT_TRUE(bench.session.describe().text().starts_with("the tracker reports the handles"))
      << bench.session.describe().text();
  EXPECT_EQ(bench.wrong, 0U);
}

}  // namespace
}  // namespace tubed::aurora
