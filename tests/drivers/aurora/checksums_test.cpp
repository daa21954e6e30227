#include "drivers/aurora/checksums.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "drivers/aurora/can_identifiers.hpp"
#include "tests/drivers/aurora/hex_bytes.hpp"

namespace tubed::aurora {
namespace {

TEST(Crc16, IsTheOneCalledArc) { EXPECT_EQ(crc16("123456789"), 0xBB3D); }

TEST(Crc16, MatchesWhatTrackersAndHostsSend) {
  const std::pair<const char*, int> vectors[] = {
      {"INIT:", 0xE3A5},
      {"OKAY", 0xA896},
      {"RESET", 0xBE6F},
      {"WARNING", 0x7423},
      {"TSTART:", 0x5423},
      {"TSTOP:", 0x2C14},
      {"TX:0001", 0x031A},
      {"TX:0801", 0xC19B},
      {"BX:0001", 0xC26D},
      {"BX:0801", 0x00EC},
      {"PHSR:00", 0x20FF},
      {"PHSR:01", 0xE03E},
      {"PHSR:02", 0xE17E},
      {"PHSR:03", 0x21BF},
      {"PHSR:04", 0xE3FE},
      {"PINIT:0A", 0xD5EB},
      {"PENA:0AD", 0xAD1E},
      {"PHF:0A", 0x2B0D},
      {"PHINF:0A0021", 0x64EC},
      {"PHINF:0A0025", 0xA7ED},
      {"VER:0", 0x65EE},
      {"VER:4", 0xA6EF},
      {"COMM:50000", 0x0048},
      {"COMM:60000", 0x000C},
      {"COMM:A0000", 0x0BF8},
      {"COMM:00000", 0x0084},
      {"BEEP:2", 0x8544},
      {"SFLIST:00", 0x514F},
      {"TSTART:80", 0x1B0B},
      {"TSTART:40", 0x1B0E},
      {"APIREV:", 0x443E},
      {"0", 0x1400},
      {"GETINFO:Features.Firmware.Version", 0x0492},
      {"1", 0xD4C1},
      {"00", 0x1414},
      {"ERROR13", 0x3A42},
      {"ERROR08", 0x6D02},
      {"ERROR18", 0xFD03},
  };
  for (const auto& [text, crc] : vectors) {
    EXPECT_EQ(crc16(text), crc) << text;
  }
}

TEST(Crc16, RunsToZeroOverABlockAndItsOwnCheckSum) { EXPECT_EQ(crc16(bytes_of("C4A5 3700 3B23")), 0); }

TEST(Crc16, GoesOnFromAnEarlierPart) { EXPECT_EQ(crc16("6789", crc16("12345")), 0xBB3D); }

TEST(CanCrc8, IsJ1850OverIdentifierAndBytes) {
  // Check value of CRC-8 SAE J1850 over "123456789" is 4B; "12" is the identifier 0x3231, low byte first.
  EXPECT_EQ(can_crc8(0x3231, as_bytes("3456789")), 0x4B);
}

TEST(CanCrc32, IsThatOfEthernetOverIdentifierAndBytes) {
  EXPECT_EQ(can_crc32(0x3231, as_bytes("3456789")), 0xCBF43926U);
}

TEST(CanCheckSums, RunOverAllFourBytesOfAnIdentifierOf29Bits) {
  // Its bytes, low one first, are "1", "2", "3" and 0x14; the first two are an identifier of 11 bits as
  // above.
  const std::uint32_t id = 0x14333231 | kCanExtended;
  const std::string same = std::string("3\x14") + "56789";
  EXPECT_EQ(can_crc8(id, as_bytes("56789")), can_crc8(0x3231, as_bytes(same)));
  EXPECT_EQ(can_crc32(id, as_bytes("56789")), can_crc32(0x3231, as_bytes(same)));
}

TEST(CanCheckSums, TellAnIdentifierOf29BitsFromTheSameNumberIn11) {
  EXPECT_NE(can_crc8(0x300, as_bytes("1234567")), can_crc8(0x300 | kCanExtended, as_bytes("1234567")));
  EXPECT_NE(can_crc32(0x300, as_bytes("1234567")), can_crc32(0x300 | kCanExtended, as_bytes("1234567")));
}

}  // namespace
}  // namespace tubed::aurora
