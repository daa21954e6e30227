// The emulated Aurora against what recordings of real ones show.
#include "drivers/laboratory/aurora_emulator/device.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/aurora/frame_counter.hpp"
#include "drivers/aurora/port_replies.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

std::string text_of(const std::vector<std::uint8_t>& bytes) { return std::string(as_text(bytes)); }

double since_s(MonotonicTime from, MonotonicTime to) { return seconds_between(from, to); }

TEST(Device, SaysResetAfterPowerOnAndAfterABreak) {
  Host host;
  EXPECT_EQ(text_of(host.listen()), "RESETBE6F\r");
  EXPECT_NEAR(since_s(kPowerOn, host.now), 1.3, 0.02);

  const MonotonicTime broken = host.now;
  host.device.receive_break(broken);
  EXPECT_EQ(text_of(host.listen()), "RESETBE6F\r");
  EXPECT_NEAR(since_s(broken, host.now), 1.3, 0.02);
}

TEST(Device, AnswersInitWithTheRecordedCharactersAfterTheRecordedTime) {
  Host host;
  host.listen();
  const MonotonicTime sent = host.now;
  host.send(init_command().bytes());
  EXPECT_EQ(text_of(host.listen()), "OKAYA896\r");
  // Ten characters there, nine back, ten bits each, and 50 ms of thinking.
  EXPECT_NEAR(since_s(sent, host.now), 19 * 10 / 9600.0 + 0.050, 1e-5);
}

TEST(Device, TakesCommandsWithoutCheckSumAndInEitherCase) {
  Host host;
  host.listen();
  EXPECT_EQ(host.ask(without_crc("init", "")), "OKAY");
  EXPECT_EQ(host.ask(without_crc("apirev", "")), "D.001.007");
}

TEST(Device, AnswersWhatIsWrongWithACommandByItsCode) {
  Host host;
  host.listen();
  EXPECT_EQ(host.ask("PHSR", "00"), "ERROR10");  // before INIT
  EXPECT_EQ(host.ask("JUMP", ""), "ERROR01");    // no such command
  EXPECT_EQ(host.ask("COMM", "90000"), "ERROR06");
  EXPECT_EQ(host.ask("COMM", "1"), "ERROR07");
  host.ask(init_command());
  EXPECT_EQ(host.ask(pinit_command(0x7F)), "ERROR08");
  EXPECT_EQ(host.ask("PENA", "0AX"), "ERROR09");
  EXPECT_EQ(host.ask("PENA", "0AD"), "ERROR0E");  // not initialised
  EXPECT_EQ(host.ask(pdis_command(0x0A)), "ERROR0F");
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "ERROR0C");  // not tracking
  host.send(as_bytes("INIT:0000\r"));
  EXPECT_EQ(text_of(host.listen()).substr(0, 7), "ERROR04");
  host.send(as_bytes("INIT\r"));
  EXPECT_EQ(text_of(host.listen()).substr(0, 7), "ERROR01");
}

TEST(Device, RefusesSetupWhileTracking) {
  Host host;
  host.start_tracking();
  for (const auto& command :
       {phsr_command(HandleQuery::kAll), pinit_command(0x0A), init_command(), tstart_command()}) {
    EXPECT_EQ(host.ask(command), "ERROR0C") << command.text();
  }
  EXPECT_EQ(host.ask(tstop_command()), "OKAY");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "00");
}

TEST(Device, ShowsTheSecondCoilOfAPlugAfterTheFirstPinitOnly) {
  Host host;
  host.listen();
  host.ask(init_command());
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "030A0010B0010C001");
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "OKAY");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeEnabled)), "020A01F0D01F");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "020B0010C001");
}

TEST(Device, TellsTheCoilsOfAPlugApartByChannelAloneAndNumbersHandlesAsRecorded) {
  Host host;
  host.prepare();
  const std::vector<std::array<int, 3>> recorded = {
      {0x0A, 1, 0}, {0x0B, 2, 0}, {0x0C, 3, 0}, {0x0D, 1, 1}, {0x0E, 2, 1}};
  std::vector<std::uint32_t> serials;
  for (const auto& [handle, port, channel] : recorded) {
    constexpr std::uint16_t kFields = kToolField | kLocationField;
    const auto tool =
        parse_tool(host.ask(phinf_command(static_cast<std::uint8_t>(handle), kFields)), kFields);
    ASSERT_TRUE(tool && tool->tool && tool->location);
    EXPECT_EQ(tool->location->port, port);
    EXPECT_EQ(tool->location->channel, channel);
    serials.push_back(tool->tool->serial_number);
  }
  EXPECT_EQ(serials[0], serials[3]);
  EXPECT_NE(serials[0], serials[1]);
}

TEST(Device, TakesTwoAndAHalfSecondsForPinitWhenToldSo) {
  DeviceSettings settings;
  settings.durations.pinit = milliseconds(2500);
  Host host(settings);
  host.listen();
  host.ask(init_command());
  const MonotonicTime sent = host.now;
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "OKAY");
  EXPECT_NEAR(since_s(sent, host.now), 2.5 + 21 * 10 / 9600.0, 0.005);
}

TEST(Device, ABlankToolIsUsableWhenItsDescriptionHasBeenWritten) {
  DeviceSettings settings;
  settings.plugs[1].memory = ToolMemory::kBlank;
  Host host(settings);
  host.listen();
  host.ask(init_command());
  EXPECT_EQ(host.ask(pinit_command(0x0B)), "ERROR13");
  EXPECT_EQ(host.ask(pinit_command(0x0A)), "OKAY");
  const std::vector<std::uint8_t> block(kToolMemoryBlock, 0x5A);
  for (int i = 0; i < 16; ++i) {
    EXPECT_EQ(host.ask(pinit_command(0x0B)), "ERROR13");
    EXPECT_EQ(host.ask(pvwr_command(0x0B, static_cast<std::uint16_t>(64 * i), block)), "OKAY");
  }
  EXPECT_EQ(host.ask(pinit_command(0x0B)), "OKAY");
}

TEST(Device, GivesEveryPoseOfItsMotionWithinTheRoundingOfBothEncodings) {
  Host host;
  Measurement measured;
  host.device.measurements().on_measurement = [&measured](const Measurement& one) { measured = one; };
  host.start_tracking();
  for (const bool binary : {true, false}) {
    ASSERT_FALSE(host.ask(binary ? bx_command(kTransforms) : tx_command(kTransforms)).empty());
    ASSERT_EQ(host.tracking.handle_count, 5);
    constexpr std::array<std::size_t, 5> kSensorOfHandle = {1, 3, 5, 2, 4};  // two coils on ports 1 and 2
    for (std::size_t i = 0; i < 5; ++i) {
      const HandleReading& reading = host.tracking.handles[i];
      const CoilSample truth = coil_sample(measured.coils[kSensorOfHandle[i] - 1]);
      EXPECT_EQ(reading.report, Report::kValid);
      EXPECT_EQ(reading.frame, measured.frame);
      EXPECT_LT((reading.p_em_mm - truth.p_em_mm).norm(), binary ? 1e-4 : 0.009);
      EXPECT_LT((coil_axis(reading.rotation) - truth.tangent_em).norm(), binary ? 1e-6 : 3e-4);
      EXPECT_EQ(reading.rotation.qz, 0);
      EXPECT_GE(reading.rotation.q0, 0);
    }
  }
}

TEST(Device, CountsByEightFortyTimesASecond) {
  Host host;
  host.start_tracking();
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  const std::uint32_t first = host.tracking.handles[0].frame;
  const MonotonicTime begin = host.now;
  host.now += seconds(10);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  const double measurements = (host.tracking.handles[0].frame - first) / 8.0;
  EXPECT_EQ(measurements, std::round(measurements));
  EXPECT_NEAR(measurements, 40 * since_s(begin, host.now), 1.01);
}

TEST(Device, TheFirstReplyAfterTstartMissesEverythingAndHasFrameZero) {
  Host host;
  host.prepare();
  ASSERT_EQ(host.ask("TSTART", "80"), "OKAY");
  // OKAY and this command take 22 ms on the wire, the first measurement 25.
  ASSERT_EQ(host.ask(tx_command(kTransforms)).substr(0, 28), "050AMISSING0002003F00000000\n");
  ASSERT_EQ(host.tracking.handle_count, 5);
  host.ask(tx_command(kTransforms));
  EXPECT_EQ(host.tracking.handles[0].report, Report::kValid);
}

TEST(Device, ANewRateIsSpokenAfterTheReplyAndAnotherOneIsNoise) {
  Host host;
  host.listen();
  LinkParameters fast;
  fast.rate = BaudRate::k115200;
  EXPECT_EQ(host.ask(comm_command(fast)), "OKAY");
  EXPECT_EQ(host.ask(init_command()), "");  // still at 9600
  host.rate = 115200;
  host.send(as_bytes("\r"));
  host.listen();
  EXPECT_EQ(host.ask(init_command()), "OKAY");
}

TEST(Device, ACommandSentWhileAReplyIsLeavingIsAnsweredAfterIt) {
  Host host;
  host.listen();
  host.send(ver_command(4).bytes());
  std::vector<std::uint8_t> bytes;
  host.now += milliseconds(60);  // the reply has some hundred characters, one a millisecond
  host.device.transmit(host.now, host.rate, bytes);
  ASSERT_GT(bytes.size(), 10U);
  const std::size_t before = bytes.size();
  host.send(apirev_command().bytes());
  host.send(init_command().bytes());
  const std::vector<std::uint8_t> rest = host.listen();
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  ReplyReader reader;
  reader.feed(bytes);
  std::vector<std::string> replies;
  while (const auto reply = reader.next()) {
    replies.emplace_back(reply->text());
  }
  ASSERT_EQ(replies.size(), 3U);
  EXPECT_GT(replies[0].size(), before);  // it was not over when they came
  EXPECT_TRUE(find_firmware(replies[0]));
  EXPECT_EQ(replies[1], "D.001.007");
  EXPECT_EQ(replies[2], "OKAY");
}

TEST(Device, PollsSentTogetherAreAnsweredOneAfterTheOther) {
  Host host;
  host.start_tracking();
  host.send(bx_command(kTransforms).bytes());
  host.send(bx_command(kTransforms).bytes());
  host.send(bx_command(kTransforms).bytes());
  ReplyReader reader;
  const std::vector<std::uint8_t> bytes = host.listen();
  reader.feed(bytes);
  std::vector<std::uint32_t> frames;
  while (const auto reply = reader.next()) {
    ASSERT_TRUE(reply->kind == ReplyKind::kBinary && decode_bx(reply->payload, host.tracking));
    frames.push_back(host.tracking.handles[0].frame);
  }
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_TRUE(frames[0] < frames[1] && frames[1] < frames[2]);  // 230 ms each at 9600 baud
}

TEST(Device, CommsRateHoldsFromTheEndOfItsReplyOn) {
  Host host;
  host.listen();
  LinkParameters fast;
  fast.rate = BaudRate::k115200;
  host.send(comm_command(fast).bytes());
  std::vector<std::uint8_t> bytes;
  host.now += milliseconds(20);  // OKAY is leaving
  host.device.transmit(host.now, host.rate, bytes);
  ASSERT_TRUE(!bytes.empty() && bytes.size() < 9);
  EXPECT_EQ(host.device.link(), LinkParameters{});
  host.send(as_bytes("A"));  // still heard at 9600
  host.listen();
  EXPECT_EQ(host.device.link(), fast);
  host.rate = 115200;
  host.send(as_bytes("PIREV:443E\r"));
  EXPECT_EQ(text_of(host.listen()).substr(0, 9), "D.001.007");
}

TEST(Device, OldFirmwareRefusesFastRates) {
  DeviceSettings settings;
  settings.firmware = Firmware::kOld;
  Host host(settings);
  host.listen();
  LinkParameters fast;
  fast.rate = BaudRate::k921600;
  EXPECT_EQ(host.ask(comm_command(fast)), "ERROR06");
  fast.rate = BaudRate::k115200;
  EXPECT_EQ(host.ask(comm_command(fast)), "OKAY");
}

TEST(Device, AnUnpluggedToolIsDisabledAndItsReplacementIsANewHandle) {
  Host host;
  host.start_tracking();
  host.device.ports().pull_out(3);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(host.tracking.handles[2].report, Report::kDisabled);
  EXPECT_EQ(host.tracking.system_status.bits, 0x0080);
  host.device.ports().plug_in(3);
  ASSERT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(host.tracking.handles[2].report, Report::kDisabled);
  EXPECT_EQ(host.tracking.system_status.bits, 0x00C0);

  EXPECT_EQ(host.ask(tstop_command()), "OKAY");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeFreed)).substr(0, 4), "010C");
  EXPECT_EQ(host.ask(phinf_command(0x0C, kToolField)), "UNOCCUPIED");
  EXPECT_EQ(host.ask(phf_command(0x0C)), "OKAY");
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "010F001");
}

TEST(Device, APowerCycleForgetsEverything) {
  Host host;
  host.start_tracking();
  host.device.power_cycle(host.now, seconds(2));
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "RESET");  // nothing hears the command
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "ERROR10");
  EXPECT_FALSE(host.device.tracking());
}

TEST(Device, WhatIsSaidWhileHungUpIsLostAndTheTrackerGoesOn) {
  Host host;
  host.start_tracking();
  host.device.hang_up(host.now, seconds(1));
  EXPECT_FALSE(host.device.connected(host.now));
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "");
  host.now += seconds(1);
  EXPECT_TRUE(host.device.connected(host.now));
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "binary");
}

}  // namespace
}  // namespace tubed::aurora::emulator
