#include "tests/second_aurora/wire_crc.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "tests/second_aurora/command_line.hpp"
#include "tests/second_aurora/replies.hpp"

namespace tubed::second_aurora {
namespace {

// The catalogue's check value and what recordings of real devices contain (README.md, Line).
TEST(SecondAuroraWireCrc, AgreesWithTheRecordings) {
  const std::pair<const char*, const char*> vectors[] = {
      {"123456789", "BB3D"},
      {"INIT:", "E3A5"},
      {"OKAY", "A896"},
      {"RESET", "BE6F"},
      {"WARNING", "7423"},
      {"TSTART:", "5423"},
      {"TSTOP:", "2C14"},
      {"TX:0001", "031A"},
      {"TX:0801", "C19B"},
      {"BX:0001", "C26D"},
      {"BX:0801", "00EC"},
      {"PHSR:00", "20FF"},
      {"PHSR:01", "E03E"},
      {"PHSR:02", "E17E"},
      {"PHSR:03", "21BF"},
      {"PHSR:04", "E3FE"},
      {"PINIT:0A", "D5EB"},
      {"PENA:0AD", "AD1E"},
      {"PHF:0A", "2B0D"},
      {"PHINF:0A0021", "64EC"},
      {"PHINF:0A0025", "A7ED"},
      {"VER:0", "65EE"},
      {"VER:4", "A6EF"},
      {"COMM:50000", "0048"},
      {"COMM:60000", "000C"},
      {"COMM:A0000", "0BF8"},
      {"COMM:00000", "0084"},
      {"BEEP:2", "8544"},
      {"SFLIST:00", "514F"},
      {"TSTART:80", "1B0B"},
      {"TSTART:40", "1B0E"},
      {"APIREV:", "443E"},
      {"0", "1400"},
      {"1", "D4C1"},
      {"00", "1414"},
      {"ERROR13", "3A42"},
      {"ERROR08", "6D02"},
      {"ERROR18", "FD03"},
      {"010ADISABLED\n0000", "B1B4"},
      {"GETINFO:Features.Firmware.Version", "0492"},
  };
  for (const auto& [text, crc] : vectors) {
    EXPECT_EQ(hex(crc16(text), 4), crc) << text;
  }
}

// A BX reply of a recording: the frame around its body is ours to the byte (README.md, Tracking replies).
TEST(SecondAuroraWireCrc, FramesABinaryBodyAsTheRecording) {
  const std::string body_hex =
      "020102310000002801000002017f280f3f80121d3f201dc63ea280cd3e1c78b1c2d8d42443c87f09c5c55f0a3d310000002a01"
      "00000000";
  Bytes body;
  for (std::size_t i = 0; i < body_hex.size(); i += 2) {
    body.push_back(static_cast<std::uint8_t>(*from_hex(std::string_view(body_hex).substr(i, 2))));
  }
  const Bytes reply = binary_framed(body);
  EXPECT_EQ(Bytes(reply.begin(), reply.begin() + 6), (Bytes{0xC4, 0xA5, 0x37, 0x00, 0x3B, 0x23}));
  EXPECT_EQ(Bytes(reply.end() - 2, reply.end()), (Bytes{0x07, 0xA1}));
}

TEST(SecondAuroraCommandLine, TakesBothFormsAndLowerCaseNames) {
  EXPECT_EQ(read_command("PINIT:0AD5EB").parameters, "0A");
  EXPECT_EQ(read_command("PINIT 0A").parameters, "0A");
  EXPECT_EQ(read_command("pinit 0A").name, "PINIT");
  EXPECT_EQ(read_command("INIT ").error, 0);
}

TEST(SecondAuroraCommandLine, NamesWhatIsWrongWithALine) {
  EXPECT_EQ(read_command("INIT").error, 0x01);
  EXPECT_EQ(read_command(std::string(300, 'A')).error, 0x02);
  EXPECT_EQ(read_command("").error, 0x03);
  EXPECT_EQ(read_command("PINIT:0AD5EC").error, 0x04);
  EXPECT_EQ(read_command("PINIT:").error, 0x04);
}

}  // namespace
}  // namespace tubed::second_aurora
