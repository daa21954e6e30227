// What the tracker says about itself, and what differs between versions of its firmware.
#include "drivers/laboratory/aurora_emulator/identity.hpp"

#include <gtest/gtest.h>

#include "drivers/aurora/port_replies.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

Host with(const Firmware& firmware) {
  DeviceSettings settings;
  settings.firmware = firmware;
  return Host(settings);
}

TEST(Identity, AnswersWhatClientsProbeWithBeforeInit) {
  Host host;
  host.listen();
  EXPECT_EQ(host.ask("SFLIST", "10"), "04");    // recorded
  EXPECT_EQ(host.ask("SFLIST", "12"), "1144");  // recorded
  EXPECT_EQ(host.ask("SFLIST", "00").size(), 8U);
  // Number of volumes, then each: shape, ten numbers of seven characters, two flags, line feed.
  EXPECT_EQ(host.ask("SFLIST", "03").size(), 1U + 1 + 10 * 7 + 2 + 1);
  EXPECT_EQ(host.ask("SFLIST", "77"), "ERROR23");
  EXPECT_EQ(host.ask("ECHO", "How now"), "How now");
  EXPECT_EQ(host.ask("VER", "5"), "013");  // recorded
  EXPECT_EQ(host.ask("GETINFO", "Features.Firmware.Version"), "Features.Firmware.Version=008\n");
  EXPECT_EQ(host.ask("GET", "Info.Timeout.PINIT"), "Info.Timeout.PINIT=5\n");  // recorded
}

TEST(Identity, VersionsOfUnitsHaveLinesWithSerialNumbersAndSayThatTheyAreEmulated) {
  Host host;
  host.listen();
  const auto count = [](const std::string& text, std::string_view word) {
    std::size_t found = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
      ++found;
    }
    return found;
  };
  const std::string generator = host.ask("VER", "7");
  EXPECT_EQ(count(generator, "Serial Number: "), 1U);
  EXPECT_GT(count(generator, "\n"), 1U);
  const std::string units = host.ask("VER", "8");
  EXPECT_EQ(count(units, "Serial Number: "), 1U + 3);  // the control unit, one sensor unit a port
  EXPECT_EQ(count(units, "emulated"), 1U + 3);
  EXPECT_NE(units.find("Serial Number: " + std::string(kControlUnitSerial) + "\n"), std::string::npos);
  EXPECT_NE(host.ask("VER", "0").find("emulated"), std::string::npos);
  EXPECT_NE(generator.find("emulated"), std::string::npos);
}

TEST(Identity, PhinfHasEveryFieldAndAnySumInTheirOrder) {
  Host host;
  host.prepare();
  std::string all;
  const std::array<std::pair<std::uint16_t, std::size_t>, 6> kFields = {
      {{0x0001, 33}, {0x0002, 8}, {0x0004, 20}, {0x0008, 2}, {0x0010, 2}, {0x0020, 14}}};
  for (const auto& [field, size] : kFields) {
    const std::string text = host.ask(phinf_command(0x0D, field));
    EXPECT_EQ(text.size(), size) << field;
    all += text;
  }
  for (std::uint16_t fields = 1; fields < 0x40; ++fields) {
    std::string expected;
    std::size_t at = 0;
    for (const auto& [field, size] : kFields) {
      expected += (fields & field) != 0 ? all.substr(at, size) : "";
      at += size;
    }
    EXPECT_EQ(host.ask(phinf_command(0x0D, fields)), expected) << fields;
  }
  EXPECT_EQ(all.substr(all.size() - 14), "A5E00042000101");  // port 1, channel 1
}

TEST(Identity, EveryFirmwareNamesItselfAndRefusesWhatItIsTooOldFor) {
  LinkParameters fast;
  fast.rate = BaudRate::k230400;
  for (const Firmware& firmware : kFirmwares) {
    SCOPED_TRACE(firmware.api_revision);
    Host host = with(firmware);
    host.listen();
    const std::string version = host.ask(ver_command(4));
    EXPECT_EQ(find_firmware(version), firmware.freeze_tag);
    EXPECT_EQ(host.ask(apirev_command()), firmware.api_revision);
    EXPECT_EQ(host.ask("GETINFO", "Features.Firmware.Version") == "ERROR01", !firmware.knows_getinfo);
    EXPECT_EQ(host.ask("GET", "Features.Firmware.Version") == "ERROR34", !firmware.knows_getinfo);
    host.start_tracking();
    EXPECT_EQ(host.ask(bx_command(kTransforms)), firmware.knows_bx ? "binary" : "ERROR01");
    EXPECT_EQ(host.ask(tx_command(kTransforms)).substr(0, 4), "050A");
    EXPECT_EQ(host.ask(comm_command(fast)), firmware.takes_fast_rates ? "OKAY" : "ERROR06");
  }
  EXPECT_FALSE(Firmware::kOld.takes_fast_rates || Firmware::kOld.knows_getinfo);
  EXPECT_FALSE(Firmware::kOldest.knows_bx);
}

TEST(Identity, PhinfWhileTrackingIsAnsweredOrRefusedAsTheSettingSays) {
  DeviceSettings settings;
  for (const auto how : {PhinfWhileTracking::kAnswered, PhinfWhileTracking::kRefused}) {
    settings.phinf_while_tracking = how;
    Host host(settings);
    host.start_tracking();
    EXPECT_EQ(host.ask(phinf_command(0x0A, kLocationField)),
              how == PhinfWhileTracking::kAnswered ? "A5E00042000100" : "ERROR0C");
    host.ask(tstop_command());
    EXPECT_EQ(host.ask(phinf_command(0x0A, kLocationField)), "A5E00042000100");
  }
}

}  // namespace
}  // namespace tubed::aurora::emulator
