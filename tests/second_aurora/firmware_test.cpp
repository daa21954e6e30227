#include <gtest/gtest.h>

#include <set>

#include "tests/second_aurora/scripted_host.hpp"

namespace tubed::second_aurora {
namespace {

TEST(SecondAuroraFirmware, PhinfCanAnswerWhileTracking) {
  Settings settings = with_coils({1});
  settings.firmware.phinf_answers_while_tracking = true;
  ScriptedHost host(settings);
  host.start_tracking();
  EXPECT_EQ(host.ask("PHINF:0A0020").substr(10), "0100");
}

TEST(SecondAuroraFirmware, PhinfCanRefuseBeforePinitAndStillSaysThePort) {
  Settings settings = with_coils({1});
  settings.firmware.phinf_before_pinit_is_blank = false;
  ScriptedHost host(settings);
  host.ask("INIT:");
  EXPECT_EQ(host.ask("PHINF:0A0001"), "ERROR0E");
  EXPECT_EQ(host.ask("PHINF:0A0020").substr(10), "0100");
}

TEST(SecondAuroraFirmware, RatesAreRefusedAsTheSettingSays) {
  Settings settings = with_coils({1});
  settings.firmware.refused_rates = "5";
  ScriptedHost host(settings);
  EXPECT_EQ(host.ask("COMM:50000"), "ERROR06");
  EXPECT_EQ(host.ask("COMM:80000"), "ERROR06");
  ASSERT_EQ(host.ask("COMM:A0001"), "OKAY");
  host.listen(20 * kMillisecond_ns);
  EXPECT_EQ(host.device.baud(), 230400);
}

TEST(SecondAuroraFirmware, AFreedNumberIsGivenToAnotherToolUnlessSetOtherwise) {
  for (const bool reused : {true, false}) {
    Settings settings = with_coils({1});
    settings.firmware.freed_numbers_are_reused = reused;
    ScriptedHost host(settings);
    host.ask("INIT:");
    host.device.unplug(1, host.now_ns);
    host.ask("PHF:0A");
    host.device.plug(3, Tool{}, host.now_ns);
    EXPECT_EQ(host.ask("PHSR:02"), reused ? "010A001" : "010B001");
  }
}

TEST(SecondAuroraFirmware, ANewPlugCanWaitForTstop) {
  Settings settings = with_coils({1});
  settings.firmware.plug_gets_handle_while_tracking = false;
  ScriptedHost host(settings);
  host.start_tracking();
  host.device.plug(2, Tool{}, host.now_ns);
  EXPECT_EQ(host.ask("TX:0001").substr(0, 2), "01");
  host.ask("TSTOP:");
  EXPECT_EQ(host.ask("PHSR:02"), "010B001");
}

TEST(SecondAuroraFirmware, InitAgainCanForgetTheHandles) {
  for (const bool frees : {false, true}) {
    Settings settings = with_coils({1});
    settings.firmware.init_frees_handles = frees;
    ScriptedHost host(settings);
    host.ask("INIT:");
    host.ask("PINIT:0A");
    host.ask("INIT:");
    EXPECT_EQ(host.ask("PHSR:02"), frees ? "010A001" : "00");
  }
}

TEST(SecondAuroraFirmware, HandlesCanComeInAnotherOrderWithEveryReply) {
  Settings settings = with_coils({1, 1});
  settings.firmware.handle_order = HandleOrder::ShuffledEachReply;
  ScriptedHost host(settings);
  host.start_tracking();
  std::set<std::string> first_handles;
  for (int i = 0; i < 20; ++i) {
    first_handles.insert(host.ask("TX:0001").substr(2, 2));
  }
  EXPECT_EQ(first_handles, (std::set<std::string>{"0A", "0B"}));
}

TEST(SecondAuroraFirmware, GetinfoCanBeUnknown) {
  Settings settings = with_coils({1});
  settings.firmware.getinfo_error = 0x01;
  ScriptedHost host(settings);
  EXPECT_EQ(host.ask("GETINFO:Features.Firmware.Version"), "ERROR01");
}

TEST(SecondAuroraFirmware, AnRs232CableStaysWithoutPower) {
  Settings settings = with_coils({1});
  settings.port_vanishes_without_power = false;
  ScriptedHost host(settings);
  host.device.power_cycle(host.now_ns, kSecond_ns);
  EXPECT_TRUE(host.device.connected(host.now_ns));
  // INIT falls on deaf ears; what comes is the RESET of the start.
  EXPECT_EQ(host.ask("INIT:"), "RESET");
}

}  // namespace
}  // namespace tubed::second_aurora
