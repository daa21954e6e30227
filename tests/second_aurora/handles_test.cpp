#include <gtest/gtest.h>

#include "tests/second_aurora/scripted_host.hpp"

namespace tubed::second_aurora {
namespace {

// Recorded on firmware Rev 006 (README.md, Handles).
TEST(SecondAuroraHandles, AToolThatCannotBeInitialisedIsListedAsDisabled) {
  Settings settings = with_coils({1});
  settings.ports[0]->rom = Rom::Blank;
  ScriptedHost host(settings);
  ASSERT_EQ(host.ask("INIT:"), "OKAY");
  EXPECT_EQ(host.ask("PINIT:0A"), "ERROR13");
  EXPECT_EQ(host.ask("PHSR:03"), "00");
  ASSERT_EQ(host.ask("TSTART:"), "OKAY");
  EXPECT_EQ(host.ask_raw("TX:0001031A"), "010ADISABLED\n0000B1B4");
  EXPECT_EQ(host.ask_binary("BX:0001"), binary_framed({0x01, 0x0A, 0x04, 0x00, 0x00}));
}

// Recorded 2005: the second coil's handle comes with the first PINIT, already initialised (README.md,
// Handles).
TEST(SecondAuroraHandles, OnePinitBringsTheSecondCoilOfThePlug) {
  ScriptedHost host(with_coils({2}));
  host.ask("INIT:");
  EXPECT_EQ(host.ask("PHSR:02"), "010A001");
  EXPECT_EQ(host.ask("PINIT:0A"), "OKAY");
  EXPECT_EQ(host.ask("PHSR:02"), "00");
  EXPECT_EQ(host.ask("PHSR:03"), "020A01F0B01F");
  EXPECT_EQ(host.ask("PENA:0AD"), "OKAY");
  EXPECT_EQ(host.ask("PHSR:00"), "020A03F0B01F");
  EXPECT_EQ(host.ask("PHSR:04"), "010A03F");
}

// Order of the recording with plugs of 2, 2 and 1 coils: 0A=p1c0 0B=p2c0 0C=p3c0 0D=p1c1 0E=p2c1.
TEST(SecondAuroraHandles, TheOrderOfHandlesIsNotThatOfPorts) {
  ScriptedHost host(with_coils({2, 2, 1}));
  host.ask("INIT:");
  for (const char* handle : {"0A", "0B", "0C"}) {
    host.ask(std::string("PINIT:") + handle);
  }
  const auto location = [&host](const char* handle) {
    const std::string information = host.ask(std::string("PHINF:") + handle + "0020");
    return information.size() == 14 ? information.substr(10) : information;
  };
  EXPECT_EQ(location("0A"), "0100");
  EXPECT_EQ(location("0C"), "0300");
  EXPECT_EQ(location("0D"), "0101");
  EXPECT_EQ(location("0E"), "0201");
}

TEST(SecondAuroraHandles, InformationHasTheFieldsWidthsAndTheSimulatorsName) {
  ScriptedHost host(with_coils({1}));
  host.ask("INIT:");
  EXPECT_EQ(host.ask("PHINF:0A0001"),
            "00000000            00000000000"
            "01");
  host.ask("PINIT:0A");
  EXPECT_EQ(host.ask("PHINF:0A0001"), "02000000TUBED SIM   0013A0000011F");
  EXPECT_EQ(host.ask("PHINF:0A0004"), "610001              ");
  EXPECT_EQ(host.ask("PHINF:0A0021").size(), 47u);
  EXPECT_EQ(host.ask("PHINF:0A003F").size(), 33u + 8 + 20 + 2 + 2 + 14);
}

TEST(SecondAuroraHandles, ATrueMakersNameIsASetting) {
  Settings settings = with_coils({1});
  settings.simulated_maker = false;
  ScriptedHost host(settings);
  host.ask("INIT:");
  host.ask("PINIT:0A");
  EXPECT_EQ(host.ask("PHINF:0A0001").substr(8, 12), "NDI         ");
}

// Recorded on a Polaris: 0080, after replug 00C0, and a new handle (README.md, Handles).
TEST(SecondAuroraHandles, ReplugWhileTrackingBringsANewHandle) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  host.device.unplug(1, host.now_ns);
  EXPECT_EQ(host.ask("TX:0001"), "010ADISABLED\n0080");
  host.device.plug(1, Tool{}, host.now_ns);
  EXPECT_EQ(host.ask("TX:0001"), "020ADISABLED\n0BDISABLED\n00C0");
  EXPECT_EQ(host.ask("PHSR:01"), "ERROR0C");
  EXPECT_EQ(host.ask("TSTOP:"), "OKAY");
  EXPECT_EQ(host.ask("PHSR:01"), "010A000");
  EXPECT_EQ(host.ask("PHINF:0A0001"), "UNOCCUPIED");
  EXPECT_EQ(host.ask("PHF:0A"), "OKAY");
  EXPECT_EQ(host.ask("PHSR:02"), "010B001");
}

TEST(SecondAuroraHandles, AHandleThatNobodyFreedIsUnoccupiedInTheNextTracking) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  host.device.unplug(1, host.now_ns);
  host.ask("TSTOP:");
  host.ask("PHSR:00");
  host.ask("TSTART:");
  EXPECT_EQ(host.ask("TX:0001"), "010AUNOCCUPIED\n0000");
}

TEST(SecondAuroraHandles, AStrangersToolIsNamedByItsOwnSerialNumber) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  Tool strange;
  strange.serial = 0x77777777;
  host.device.plug(1, strange, host.now_ns);
  EXPECT_EQ(host.ask("TX:0001"), "020ADISABLED\n0BDISABLED\n00C0");
  host.ask("TSTOP:");
  host.ask("PINIT:0B");
  EXPECT_EQ(host.ask("PHINF:0B0001").substr(23, 8), "77777777");
}

// Genuine definition files are shorter than the memory: six blocks leave the tool ERROR13 (README.md,
// Handles).
TEST(SecondAuroraHandles, ABlankToolWorksOnlyAfterAllSixteenBlocks) {
  Settings settings = with_coils({1});
  settings.ports[0]->rom = Rom::Blank;
  ScriptedHost host(settings);
  host.ask("INIT:");
  for (unsigned block = 0; block < 16; ++block) {
    EXPECT_EQ(host.ask("PINIT:0A"), "ERROR13") << block;
    EXPECT_EQ(host.ask("PVWR:0A" + hex(block * 64, 4) + std::string(128, '0')), "OKAY");
  }
  const std::int64_t before_ns = host.now_ns;
  EXPECT_EQ(host.ask("PINIT:0A"), "OKAY");
  EXPECT_LT(host.now_ns - before_ns, 300 * kMillisecond_ns);
}

TEST(SecondAuroraHandles, ErrorsNameHandleModeAndParameters) {
  ScriptedHost host(with_coils({1}));
  EXPECT_EQ(host.ask("PHSR:00"), "ERROR10");
  EXPECT_EQ(host.ask("TX:0001"), "ERROR0C");
  EXPECT_EQ(host.ask("LED:0AAB"), "ERROR01");
  host.ask("INIT:");
  EXPECT_EQ(host.ask("PINIT:22"), "ERROR08");
  EXPECT_EQ(host.ask("PENA:0AD"), "ERROR0E");
  EXPECT_EQ(host.ask("PHF:"), "ERROR07");
  EXPECT_EQ(host.ask("PHSR:09"), "ERROR23");
  EXPECT_EQ(host.ask("BX:0001"), "ERROR0C");
  EXPECT_EQ(host.ask("TSTOP:"), "ERROR0C");
  host.ask("TSTART:");
  EXPECT_EQ(host.ask("TX:1000"), "ERROR23");
  EXPECT_EQ(host.ask("PHINF:0A0001"), "ERROR0C");
}

TEST(SecondAuroraHandles, ProbesOfClientsInUseAreAnswered) {
  ScriptedHost host(with_coils({1}));
  EXPECT_NE(host.ask("VER:0").find("\nFreeze Tag: AURORA Rev 006\n"), std::string::npos);
  EXPECT_EQ(host.ask("VER:5"), "013");
  EXPECT_NE(host.ask("VER:8").find("NDI S/N: S2-00078\n"), std::string::npos);
  EXPECT_EQ(host.ask_raw("APIREV ").substr(0, 9), "D.001.005");
  EXPECT_EQ(host.ask("SFLIST:10"), "04");
  EXPECT_EQ(host.ask("SFLIST:12"), "1144");
  EXPECT_EQ(host.ask("SFLIST:03").size(), 75u);
  EXPECT_EQ(host.ask("ECHO:Testing!"), "Testing!");
  EXPECT_EQ(host.ask("GET:Info.Timeout.PINIT"), "Info.Timeout.PINIT=5\n");
  EXPECT_EQ(host.ask("GET:Info.Nothing"), "ERROR34");
  EXPECT_EQ(host.ask("GETINFO:Features.Firmware.Version"), "Features.Firmware.Version=006\n");
  EXPECT_EQ(host.ask("BEEP:2"), "1");
  EXPECT_EQ(host.ask("BEEP:2"), "0");
  host.ask("INIT:");
  EXPECT_EQ(host.ask("PHRQ:********010100"), "0A");
  EXPECT_EQ(host.ask("PHRQ:********010200"), "0B");
  EXPECT_EQ(host.ask("PHRQ:********01**00"), "0C");
  EXPECT_EQ(host.ask("PINIT:0B"), "ERROR0D");
}

}  // namespace
}  // namespace tubed::second_aurora
