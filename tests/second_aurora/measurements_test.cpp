#include <gtest/gtest.h>

#include <cstring>

#include "tests/second_aurora/scripted_host.hpp"

namespace tubed::second_aurora {
namespace {

// Of a TX reply that lists one coil.
std::uint32_t frame_of(const std::string& text) {
  return from_hex(text.substr(text.size() - 13, 8)).value_or(1);
}
std::uint32_t port_status_of(const std::string& text) {
  return from_hex(text.substr(text.size() - 21, 8)).value_or(0);
}
bool is_missing(const std::string& text) { return text.substr(4, 7) == "MISSING"; }

TEST(SecondAuroraMeasurements, TheFirstReplyAfterTstartIsMissingWithFrameZero) {
  ScriptedHost host(with_coils({1}));
  host.ask("INIT:");
  host.ask("PINIT:0A");
  host.ask("PENA:0AD");
  host.ask("TSTART:");
  host.listen(kSecond_ns);
  EXPECT_EQ(host.ask("TX:0001"), "010AMISSING0002003F00000000\n0000");
  EXPECT_FALSE(is_missing(host.ask("TX:0001")));
}

TEST(SecondAuroraMeasurements, TextIsTheTruthToItsLastDigit) {
  ScriptedHost host(with_coils({1}), [](int, int, std::int64_t) {
    return Pose{0.5, -0.5, 0.7071, 0, 12.344, -0.006, -234.5, 0.1234};
  });
  host.start_tracking();
  const std::string text = host.ask("TX:0001");
  EXPECT_EQ(text.substr(0, 4 + 24 + 21 + 6), "010A+05000-05000+07071+00000+001234-000001-023450+01234");
  EXPECT_EQ(port_status_of(text), 0x0002003Fu);
  // A recorded reply has 70 bytes per valid handle, beside count and system status.
  EXPECT_EQ(text.size(), 2u + 70 + 4);
}

// Four valid coils of 42 bytes, count, system status, header and CRC: 179 bytes.
TEST(SecondAuroraMeasurements, BinaryIsTheTruthInFloats) {
  ScriptedHost host(with_coils({2, 2}));
  host.start_tracking();
  const Bytes reply = host.ask_binary("BX:0801");
  ASSERT_EQ(reply.size(), 179u);
  EXPECT_EQ(crc16(std::span(reply).first(6)), 0);
  EXPECT_EQ(crc16(reply), 0);
  // Second in the list is port 2 channel 0.
  const std::size_t at = 7 + 42;
  EXPECT_EQ(reply[at], 0x0B);
  EXPECT_EQ(reply[at + 1], 0x01);
  float x_mm = 0, z_mm = 0;
  std::memcpy(&x_mm, &reply[at + 2 + 16], 4);
  std::memcpy(&z_mm, &reply[at + 2 + 24], 4);
  std::uint32_t frame = 0;
  std::memcpy(&frame, &reply[at + 2 + 36], 4);
  ASSERT_TRUE(host.truths.contains(frame));
  EXPECT_EQ(x_mm, 20.0f);
  EXPECT_EQ(z_mm, static_cast<float>(moving_away(2, 0, host.truths[frame].time_ns).z_mm));
}

// 323.2 counts/s of the recordings (README.md, Measurements), going on while nobody tracks.
TEST(SecondAuroraMeasurements, TheCounterRunsByEightAndGoesOnOverTstop) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  const std::uint32_t before = frame_of(host.ask("TX:0001"));
  const std::int64_t before_ns = host.truths[before].time_ns;
  host.ask("TSTOP:");
  host.listen(100 * kSecond_ns);
  host.ask("TSTART:");
  host.ask("TX:0001");
  host.listen(kSecond_ns);
  const std::uint32_t after = frame_of(host.ask("TX:0001"));
  EXPECT_EQ((after - before) % 8, 0u);
  const double elapsed_s = 1e-9 * static_cast<double>(host.truths[after].time_ns - before_ns);
  EXPECT_NEAR((after - before) / elapsed_s, 323.2, 0.01);
}

TEST(SecondAuroraMeasurements, TheCounterOfAnotherFirmwareStopsWithTstop) {
  Settings settings = with_coils({1});
  settings.firmware.counter_stops_with_tstop = true;
  ScriptedHost host(settings);
  host.start_tracking();
  const std::uint32_t before = frame_of(host.ask("TX:0001"));
  host.ask("TSTOP:");
  host.listen(100 * kSecond_ns);
  host.ask("TSTART:");
  host.ask("TX:0001");
  host.listen(100 * kMillisecond_ns);
  EXPECT_LT(frame_of(host.ask("TX:0001")) - before, 400u);
}

TEST(SecondAuroraMeasurements, Option80ResetsTheCounter) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  host.ask("TSTOP:");
  host.ask("TSTART:80");
  host.ask("TX:0001");
  host.listen(100 * kMillisecond_ns);
  EXPECT_LT(frame_of(host.ask("TX:0001")), 200u);
}

TEST(SecondAuroraMeasurements, TheCounterWraps) {
  Settings settings = with_coils({1});
  settings.first_frame = 0xFFFFFFF8u - 8 * 40 * 10;
  ScriptedHost host(settings);
  host.start_tracking();
  EXPECT_GT(frame_of(host.ask("TX:0001")), 0xFFFFF000u);
  host.listen(10 * kSecond_ns);
  EXPECT_LT(frame_of(host.ask("TX:0001")), 8u * 41 * 10);
}

TEST(SecondAuroraMeasurements, AReportIsNoYoungerThanTheDelay) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  for (int i = 0; i < 50; ++i) {
    const std::int64_t asked_ns = host.now_ns;
    const std::uint32_t frame = frame_of(host.ask("TX:0001"));
    // 12 bytes there at 9600, then at least report_delay_ns old and at most one period more.
    const double age_ms = 1e-6 * static_cast<double>(asked_ns + 12 * 1'041'667 - host.truths[frame].time_ns);
    EXPECT_GT(age_ms, 5 - 1.01);
    EXPECT_LT(age_ms, 5 + 24.76);
    host.listen(7 * kMillisecond_ns);
  }
}

// Wire time of five coils: 20.2 ms of 24.8 ms between measurements, so that none is missed.
TEST(SecondAuroraMeasurements, TenMinutesOfPollingFiveCoilsSeeEveryMeasurement) {
  ScriptedHost host(with_coils({2, 2, 1}));
  host.ask("COMM:50000");
  host.listen(20 * kMillisecond_ns);
  host.baud = 115200;
  host.start_tracking();
  const auto next_frame = [&host] {
    const Bytes reply = host.ask_binary("BX:0801");
    EXPECT_EQ(crc16(reply), 0);
    std::uint32_t frame = 0;
    std::memcpy(&frame, &reply.at(7 + 2 + 36), 4);
    return frame;
  };
  std::uint32_t previous = next_frame();
  host.truths.clear();
  for (const std::int64_t until_ns = host.now_ns + 600 * kSecond_ns; host.now_ns < until_ns;) {
    const std::uint32_t frame = next_frame();
    ASSERT_LE(frame - previous, 8u);
    previous = frame;
  }
  EXPECT_NEAR(static_cast<double>(host.truths.size()), 600 * 40.4, 2);
}

TEST(SecondAuroraMeasurements, ACoilOutsideTheVolumeComesOnlyWhenAskedFor) {
  Settings settings = with_coils({1});
  settings.volume.missing_share = 0;
  ScriptedHost host(settings, [](int, int, std::int64_t) { return Pose{1, 0, 0, 0, 300, 0, -200, 0}; });
  host.start_tracking();
  const std::string without = host.ask("TX:0001");
  EXPECT_TRUE(is_missing(without));
  EXPECT_EQ(port_status_of(without), 0x0002007Fu);
  const std::string with = host.ask("TX:0801");
  EXPECT_EQ(with.substr(4 + 24, 7), "+030000");
  EXPECT_EQ(port_status_of(with), 0x0002007Fu);
}

TEST(SecondAuroraMeasurements, ABrokenCoilIsMissingWithItsBit) {
  Settings settings = with_coils({1});
  settings.ports[0]->broken_coils = 1;
  ScriptedHost host(settings);
  host.start_tracking();
  const std::string text = host.ask("TX:0801");
  EXPECT_TRUE(is_missing(text));
  EXPECT_EQ(port_status_of(text), 0x0002013Fu);
}

TEST(SecondAuroraMeasurements, SystemStatusSaysWhatWasRaised) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  const auto system_status = [&host] {
    const std::string text = host.ask("TX:0001");
    return text.substr(text.size() - 4);
  };
  host.device.raise_system_status(0x0200, host.now_ns);
  EXPECT_EQ(system_status(), "0200");
  host.device.unplug_field_generator(host.now_ns);
  host.listen(100 * kMillisecond_ns);
  EXPECT_EQ(system_status(), "0600");
  EXPECT_TRUE(is_missing(host.ask("TX:0001")));
  host.device.plug_field_generator(host.now_ns);
  host.device.clear_system_status(0x0200, host.now_ns);
  EXPECT_EQ(system_status(), "0000");
}

TEST(SecondAuroraMeasurements, RefusedBinaryIsAnsweredInText) {
  Settings settings = with_coils({1});
  settings.firmware.bx_error = 0x32;
  ScriptedHost host(settings);
  host.start_tracking();
  EXPECT_EQ(host.ask("BX:0801"), "ERROR32");
  EXPECT_EQ(host.ask("TX:0801").substr(0, 4), "010A");
}

TEST(SecondAuroraMeasurements, HandlesComeInTheOrderOfTheSetting) {
  Settings settings = with_coils({1, 1});
  settings.firmware.handle_order = HandleOrder::Descending;
  ScriptedHost host(settings);
  host.ask("INIT:");
  EXPECT_EQ(host.ask("PHSR:00"), "020B0010A001");
  host.start_tracking();
  const std::string text = host.ask("TX:0001");
  EXPECT_EQ(text.substr(0, 4), "020B");
  EXPECT_EQ(text.substr(72, 2), "0A");
}

}  // namespace
}  // namespace tubed::second_aurora
