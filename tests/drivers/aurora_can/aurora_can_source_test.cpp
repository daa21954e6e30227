#include "drivers/aurora_can/aurora_can_source.hpp"

#include <gtest/gtest.h>

#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/aurora_can/can_packer.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/drivers/aurora_can/paired_port.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

DriverSettings default_settings() {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : aurora_can_settings()) {
    values[setting.name] = setting.default_value;
  }
  return DriverSettings(std::move(values));
}

RoomDescription room_with(int sensors) {
  InstrumentDescription catheter;
  for (int sensor = 1; sensor <= sensors; ++sensor) {
    catheter.coils.push_back({sensor, 10.0 * sensor, false});
  }
  RoomDescription room;
  room.instruments = {catheter};
  return room;
}

/// Three coils; coil i stands at x = 10 i mm. The n-th measurement was made 5 ms before it was sent.
class AuroraCanSourceTest : public testing::TestWithParam<CanLayout> {
 protected:
  static constexpr int kCoils = 3;

  void SetUp() override {
    ASSERT_TRUE(source.open().ok);
    ASSERT_EQ(read(), ReadOutcome::kNothing);  // which opens the port
  }

  static CanReport report(std::uint32_t number) {
    CanReport made;
    made.sync = {8 * number, can_time_us(monotonic_now() - milliseconds(5))};
    for (int coil = 0; coil < kCoils; ++coil) {
      aurora::HandleReading& reading = made.coils[static_cast<std::size_t>(coil)];
      reading.report = aurora::Report::kValid;
      reading.rotation = {1, 0, 0, 0};
      reading.p_em_mm = {10.0 * coil, 0, -200};
      reading.indicator = 0.01;
      reading.port_status.bits = 0x3F;
    }
    return made;
  }
  std::vector<aurora::CanFrame> frames(const CanReport& of) {
    const auto packed = packer.pack(of, monotonic_now());
    return {packed.begin(), packed.end()};
  }
  ReadOutcome read() { return source.read(frame); }
  /// Until read() gives something else than kNothing, or the time is over.
  ReadOutcome read_for(std::chrono::nanoseconds longest) {
    const MonotonicTime end = monotonic_now() + longest;
    ReadOutcome outcome = ReadOutcome::kNothing;
    while (outcome == ReadOutcome::kNothing && monotonic_now() < end) {
      outcome = read_until(source, frame, end);
    }
    return outcome;
  }
  std::string words() { return std::string(source.condition().words.text()); }
  DeviceState state() { return source.condition().state; }
  bool says(const char* word) { return words().find(word) != std::string::npos; }
  /// Reads, and nothing may come, until the words of the source hold `word`; false: not within `longest`.
  bool says_within(std::chrono::nanoseconds longest, const char* word) {
    for (const MonotonicTime end = monotonic_now() + longest; !says(word) && monotonic_now() < end;) {
      EXPECT_EQ(read_until(source, frame, monotonic_now() + milliseconds(20)), ReadOutcome::kNothing);
    }
    return says(word);
  }

  Bus bus;
  AuroraCanSource source{room_with(kCoils), default_settings(), std::make_unique<PairedPort>(bus)};
  CanPacker packer{GetParam(), kCoils};
  EmFrame frame;
};
INSTANTIATE_TEST_SUITE_P(Layouts, AuroraCanSourceTest, testing::Values(CanLayout::kClassic, CanLayout::kFd));

TEST_P(AuroraCanSourceTest, AMeasurementArrivesWhole) {
  bus.send(frames(report(10)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(frame.coil_count, kCoils);
  EXPECT_EQ(frame.tracker_frame, 80U);
  EXPECT_EQ(frame.origin, Origin::kDevice);
  for (std::size_t i = 0; i < kCoils; ++i) {
    EXPECT_EQ(frame.coils[i].status, CoilStatus::kOk);
    EXPECT_NEAR(frame.coils[i].p_em_mm.x(), 10.0 * static_cast<double>(i), 1e-9);
    EXPECT_NEAR(frame.coils[i].tangent_em.z(), 1, 1e-9);
  }
}

TEST_P(AuroraCanSourceTest, WaitingEndsWhenAFrameIsThereAndTakesNone) {
  const MonotonicTime soon = monotonic_now() + milliseconds(5);
  source.wait(soon);
  EXPECT_GE(monotonic_now(), soon) << "there is none";
  bus.send(frames(report(10)));
  const MonotonicTime began = monotonic_now();
  for (int i = 0; i < 3; ++i) {
    source.wait(began + std::chrono::minutes(1));
  }
  EXPECT_LT(monotonic_now(), began + milliseconds(500));
  EXPECT_EQ(read(), ReadOutcome::kFrame);
}

TEST_P(AuroraCanSourceTest, WaitingEndsWhenAMeasurementWillNotBecomeWhole) {
  auto sent = frames(report(10));
  sent.pop_back();
  bus.send(sent);
  EXPECT_EQ(read(), ReadOutcome::kNothing) << "a frame may follow";
  const MonotonicTime began = monotonic_now();
  source.wait(began + milliseconds(900));
  EXPECT_LT(monotonic_now(), began + milliseconds(500));
  EXPECT_EQ(read(), ReadOutcome::kFrame);
}

TEST_P(AuroraCanSourceTest, TheTimeIsThatOfTheMeasurementNotOfItsArrival) {
  const MonotonicTime before = monotonic_now();
  bus.send(frames(report(10)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_NEAR(seconds_between(frame.measured, frame.received), 0.005, 0.005);
  EXPECT_GE(frame.measured, before - milliseconds(6));
  EXPECT_LE(frame.measured, monotonic_now() - milliseconds(4));
}

TEST_P(AuroraCanSourceTest, WithoutFollowUpsTheConfiguredLatencyCounts) {
  auto sent = frames(report(10));
  sent.erase(sent.begin() + 1);
  bus.send(sent);
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_NEAR(seconds_between(frame.measured, frame.received), 0.025, 0.005);
}

TEST_P(AuroraCanSourceTest, ALostFrameCostsItsCoilWhichIsMissing) {
  auto sent = frames(report(10));
  sent.erase(sent.begin() + 3);  // of coil 0, behind SYNC, FOLLOW-UP and STATUS
  bus.send(sent);
  ASSERT_EQ(read_for(milliseconds(200)), ReadOutcome::kFrame);
  EXPECT_EQ(frame.coils[0].status, CoilStatus::kMissing);
  EXPECT_TRUE(std::isnan(frame.coils[0].p_em_mm.x()));
  EXPECT_EQ(frame.coils[1].status, CoilStatus::kOk);
  EXPECT_EQ(source.assembler_counts().lost_coils, 1U);
  EXPECT_EQ(source.assembler_counts().partial_coils, GetParam() == CanLayout::kClassic ? 1U : 0U);
}

TEST_P(AuroraCanSourceTest, WhatTheBusLosesIsSaidWhileItDoesAndFiveSecondsLonger) {
  bus.send(frames(report(10)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(words(), "");
  auto sent = frames(report(12));
  sent.pop_back();
  bus.send(sent);
  ASSERT_EQ(read_for(milliseconds(200)), ReadOutcome::kFrame);
  EXPECT_EQ(words(), "can0 loses frames: 1 coils, 1 measurements did not come whole");
  EXPECT_EQ(state(), DeviceState::kRunning);
}

TEST_P(AuroraCanSourceTest, CoilsThatTheGatewayDoesNotHaveAreNamed) {
  CanReport two_absent = report(10);
  two_absent.coils[0].report = aurora::Report::kDisabled;
  two_absent.coils[2].report = aurora::Report::kDisabled;
  bus.send(frames(two_absent));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(words(), "not plugged in at the gateway: sensor 1, sensor 3");
  bus.send(frames(report(11)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(words(), "");
}

TEST_P(AuroraCanSourceTest, ADamagedFrameIsRefusedAndItsCoilMissing) {
  auto sent = frames(report(10));
  sent.back().bytes[1] ^= 0x10;
  bus.send(sent);
  EXPECT_EQ(read(), ReadOutcome::kRefused);
  ASSERT_EQ(read_for(milliseconds(200)), ReadOutcome::kFrame);
  EXPECT_EQ(frame.coils[2].status, CoilStatus::kMissing);
  EXPECT_EQ(source.assembler_counts().bad_frames, 1U);
}

TEST_P(AuroraCanSourceTest, ARepeatedMeasurementIsNotANewOne) {
  const auto sent = frames(report(10));
  bus.send(sent);
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  bus.send(sent);
  EXPECT_EQ(read(), ReadOutcome::kNothing);
}

TEST_P(AuroraCanSourceTest, ACoilThatLeapsIsNotBelievedAtOnce) {
  bus.send(frames(report(10)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  CanReport leap = report(11);
  leap.coils[1].p_em_mm.x() += 500;
  bus.send(frames(leap));
  EXPECT_EQ(read(), ReadOutcome::kRefused);
  EXPECT_EQ(source.counts().leaps, 1U);
}

TEST_P(AuroraCanSourceTest, AnEmulatedTrackerIsSaidToBeOne) {
  CanReport simulated = report(10);
  simulated.gateway_error = aurora::kCanSimulated;
  bus.send(frames(simulated));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(frame.origin, Origin::kSimulated);
}

TEST_P(AuroraCanSourceTest, NothingIsHandedOnBeforeItsOriginIsKnown) {
  auto first = frames(report(10));
  first.erase(first.begin() + 2);  // STATUS
  bus.send(first);
  EXPECT_EQ(read(), ReadOutcome::kNothing);
  for (std::uint32_t number = 11; number <= 11 + CanPacker::kStatusEvery; ++number) {
    bus.send(frames(report(number)));
    if (read() == ReadOutcome::kFrame) {
      return;
    }
  }
  FAIL() << "STATUS was sent again, but no measurement came";
}

TEST_P(AuroraCanSourceTest, BusOffIsToldInWordsEachTimeItHappens) {
  bus.send_error(CAN_ERR_BUSOFF);
  ASSERT_EQ(read(), ReadOutcome::kNothing);
  EXPECT_TRUE(says("can0 is bus-off")) << words();
  EXPECT_EQ(state(), DeviceState::kStarting);
  bus.send_error(CAN_ERR_BUSOFF);
  EXPECT_EQ(read(), ReadOutcome::kNothing);
  bus.send_error(CAN_ERR_RESTARTED);
  EXPECT_EQ(read(), ReadOutcome::kNothing);
  bus.send(frames(report(10)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(words(), "");
  EXPECT_EQ(state(), DeviceState::kRunning);
  bus.send_error(CAN_ERR_BUSOFF);
  ASSERT_EQ(read(), ReadOutcome::kNothing);
  EXPECT_TRUE(says("restarted 1 times")) << words();
  EXPECT_EQ(state(), DeviceState::kReconnecting);
  EXPECT_EQ(source.counts().bus_offs, 3U);
  EXPECT_EQ(source.counts().restarts, 1U);
}

TEST_P(AuroraCanSourceTest, SilenceOfABusThatIsOffIsNoNews) {
  bus.send_error(CAN_ERR_BUSOFF);
  ASSERT_EQ(read(), ReadOutcome::kNothing);
  const std::string off = words();
  EXPECT_TRUE(says("is bus-off")) << off;
  EXPECT_FALSE(says_within(milliseconds(2200), "can-gateway"));
  EXPECT_EQ(words(), off);
  bus.send_error(CAN_ERR_RESTARTED);
  EXPECT_TRUE(says_within(milliseconds(2500), "carries no measurements"))
      << "on the bus again, and nothing comes";
  EXPECT_FALSE(says("is bus-off")) << words();
}

TEST_P(AuroraCanSourceTest, AnInterfaceThatWentDownIsFoundAgainWithoutARestart) {
  bus.send(frames(report(10)));
  ASSERT_EQ(read(), ReadOutcome::kFrame);
  bus.refuses_with = ENETDOWN;
  bus.unplug();
  ASSERT_EQ(read(), ReadOutcome::kNothing);
  EXPECT_TRUE(says("is not there")) << words();
  EXPECT_EQ(state(), DeviceState::kReconnecting);
  EXPECT_TRUE(says_within(milliseconds(300), "can0 is down: `ip link set")) << words();
  const int openings = bus.openings;
  EXPECT_EQ(read_for(milliseconds(500)), ReadOutcome::kNothing);
  EXPECT_NEAR(bus.openings - openings, 5, 2) << "ten times a second";
  bus.refuses_with = 0;
  EXPECT_EQ(read_for(milliseconds(150)), ReadOutcome::kNothing);
  bus.send(frames(report(50)));
  EXPECT_EQ(read(), ReadOutcome::kFrame);
  EXPECT_EQ(state(), DeviceState::kRunning);
  EXPECT_FALSE(says("is down")) << words();
}

TEST_P(AuroraCanSourceTest, SilenceIsToldAfterASecondWithWhatIsMissing) {
  const MonotonicTime start = monotonic_now();
  ASSERT_TRUE(says_within(milliseconds(3000), "tubectl can-gateway")) << words();
  EXPECT_NEAR(seconds_between(start, monotonic_now()), 1.0, 0.3);
  EXPECT_EQ(state(), DeviceState::kStarting);
}

TEST_P(AuroraCanSourceTest, AGatewayWithFewerCoilsIsToldWhileTheOthersAreMeasured) {
  CanPacker two(GetParam(), 2);
  bus.send(two.pack(report(10), monotonic_now()));
  ASSERT_EQ(read_for(milliseconds(200)), ReadOutcome::kFrame);
  EXPECT_EQ(frame.coils[1].status, CoilStatus::kOk);
  EXPECT_EQ(frame.coils[2].status, CoilStatus::kMissing);
  EXPECT_EQ(words(), "can0: the gateway sends 2 coils, the configuration has sensors up to 3");
  EXPECT_EQ(state(), DeviceState::kRunning);
}

TEST_P(AuroraCanSourceTest, FramesOfAnotherBaseAreNotHeard) {
  CanPacker elsewhere(GetParam(), kCoils, aurora::CanBase{0x680});
  bus.send(elsewhere.pack(report(10), monotonic_now()));
  EXPECT_EQ(read(), ReadOutcome::kNothing);
  EXPECT_EQ(source.assembler_counts().measurements, 0U);
  EXPECT_GT(source.assembler_counts().foreign, 0U);
}

TEST_P(AuroraCanSourceTest, IdentifiersOf29BitsCarryTheSame) {
  const DriverSettings settings =
      default_settings().with("base_id", std::int64_t{0x18FF'5000}).with("extended_ids", true);
  Bus other_bus;
  AuroraCanSource other(room_with(kCoils), settings, std::make_unique<PairedPort>(other_bus));
  ASSERT_TRUE(other.open().ok);
  ASSERT_EQ(other.read(frame), ReadOutcome::kNothing);  // which opens the port
  CanPacker extended(GetParam(), kCoils, aurora::CanBase{0x18FF'5000 | aurora::kCanExtended});
  other_bus.send(frames(report(9)));  // of base 0x300
  other_bus.send(extended.pack(report(10), monotonic_now()));
  ASSERT_EQ(other.read(frame), ReadOutcome::kFrame);
  EXPECT_EQ(frame.tracker_frame, 80U);
  EXPECT_EQ(frame.coils[2].status, CoilStatus::kOk);
}

TEST_P(AuroraCanSourceTest, ATrackerThatIsAwayIsToldFromAGatewayThatIs) {
  bus.send(packer.pack_away(aurora::CanTrackerState::kNoTracker, monotonic_now()));
  EXPECT_TRUE(says_within(milliseconds(1500), "can0: the gateway hears no tracker: is it on")) << words();
  bus.send(packer.pack_away(aurora::CanTrackerState::kStarting, monotonic_now()));
  EXPECT_TRUE(says_within(milliseconds(1500), "can0: the gateway starts the tracker")) << words();
  EXPECT_TRUE(says_within(milliseconds(4500), "is `tubectl can-gateway` running"))
      << "nothing comes from the gateway any more: " << words();
  EXPECT_EQ(state(), DeviceState::kStarting);
}

// Whoever loses the STATUS of the first measurement after that must not take an emulated tracker for a real
// one.
TEST_P(AuroraCanSourceTest, AfterTheTrackerWasAwayItsOriginIsAskedForAgain) {
  bus.send(packer.pack_away(aurora::CanTrackerState::kStarting, monotonic_now()));
  CanReport simulated = report(10);
  simulated.gateway_error = aurora::kCanSimulated;
  auto first = frames(simulated);
  first.erase(first.begin() + 2);  // STATUS
  bus.send(first);
  EXPECT_EQ(read(), ReadOutcome::kNothing);
  for (std::uint32_t number = 11; number <= 11 + CanPacker::kStatusEvery; ++number) {
    simulated.sync = report(number).sync;
    bus.send(frames(simulated));
    if (read() == ReadOutcome::kFrame) {
      EXPECT_EQ(frame.origin, Origin::kSimulated);
      return;
    }
  }
  FAIL() << "STATUS was sent again, but no measurement came";
}

TEST(AuroraCanSettings, ABaseThatIsNoneIsRefusedInWords) {
  const auto refusal = [](std::int64_t number, bool is_extended) -> std::string {
    try {
      static_cast<void>(
          can_base_of(default_settings().with("base_id", number).with("extended_ids", is_extended)));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(0x680, false), "");
  EXPECT_EQ(refusal(0x18FF'5000, true), "");
  EXPECT_NE(refusal(0x310, false).find("aurora-can.base_id = 0x310: a base is a multiple of 0x80"),
            std::string::npos);
  EXPECT_NE(refusal(0x18FF'5000, false).find("extended_ids = true"), std::string::npos);
}

}  // namespace
}  // namespace tubed
