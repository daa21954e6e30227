#include "drivers/aurora/command.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tubed::aurora {
namespace {

TEST(Command, IsSentWithNameParametersCheckSumAndCarriageReturn) {
  EXPECT_EQ(init_command().text(), "INIT:E3A5\r");
  EXPECT_EQ(apirev_command().text(), "APIREV:443E\r");
  EXPECT_EQ(ver_command(4).text(), "VER:4A6EF\r");
  EXPECT_EQ(phsr_command(HandleQuery::kToBeInitialised).text(), "PHSR:02E17E\r");
  EXPECT_EQ(phsr_command(HandleQuery::kEnabled).text(), "PHSR:04E3FE\r");
  EXPECT_EQ(pinit_command(0x0A).text(), "PINIT:0AD5EB\r");
  EXPECT_EQ(pena_command(0x0A, TrackingPriority::kDynamic).text(), "PENA:0ADAD1E\r");
  EXPECT_EQ(phf_command(0x0A).text(), "PHF:0A2B0D\r");
  EXPECT_EQ(phinf_command(0x0A, kToolField | kLocationField).text(), "PHINF:0A002164EC\r");
  EXPECT_EQ(phinf_command(0x0A, kToolField | kPartNumberField | kLocationField).text(), "PHINF:0A0025A7ED\r");
  EXPECT_EQ(tstart_command().text(), "TSTART:5423\r");
  EXPECT_EQ(tstop_command().text(), "TSTOP:2C14\r");
  EXPECT_EQ(tx_command(kTransforms | kAlsoOutOfVolume).text(), "TX:0801C19B\r");
  EXPECT_EQ(bx_command(kTransforms).text(), "BX:0001C26D\r");
  EXPECT_EQ(bx_command(kTransforms | kAlsoOutOfVolume).text(), "BX:080100EC\r");
}

TEST(Command, SetsTheLinkByOneCharacterEach) {
  EXPECT_EQ(comm_command({}).text(), "COMM:000000084\r");
  EXPECT_EQ(comm_command({.rate = BaudRate::k115200}).text(), "COMM:500000048\r");
  EXPECT_EQ(comm_command({.rate = BaudRate::k921600}).text(), "COMM:60000000C\r");
  EXPECT_EQ(comm_command({.rate = BaudRate::k230400}).text(), "COMM:A00000BF8\r");
}

TEST(Command, WithoutACheckSumKeepsItsSpace) {
  EXPECT_EQ(without_crc("INIT", "").text(), "INIT \r");
  EXPECT_EQ(without_crc("VER", "4").text(), "VER 4\r");
}

TEST(Command, WritesABlockOfToolMemoryIn144Bytes) {
  std::vector<std::uint8_t> block(kToolMemoryBlock);
  for (std::size_t i = 0; i < block.size(); ++i) {
    block[i] = static_cast<std::uint8_t>(i);
  }
  const CommandLine line = pvwr_command(0x0B, 0x03C0, block);
  EXPECT_EQ(line.text().size(), 144U);
  EXPECT_EQ(line.text().substr(0, 19), "PVWR:0B03C000010203");
}

TEST(Command, FillsAShortBlockOfToolMemoryWithZeros) {
  const std::vector<std::uint8_t> block = {0xFF};
  const CommandLine line = pvwr_command(0x0A, 0, block);
  EXPECT_EQ(line.text().substr(11, 128), "FF" + std::string(126, '0'));
}

TEST(Command, TooLongForTheTrackerIsNotSentAtAll) {
  EXPECT_TRUE(with_crc("GET", std::string(200, 'x')).empty());
  EXPECT_TRUE(without_crc("GET", std::string(200, 'x')).empty());
  EXPECT_TRUE(get_command("Info.Timeout.PINIT").text().starts_with("GET:Info.Timeout.PINIT"));
}

TEST(ParseCommand, TakesBothFormsApart) {
  const auto with = parse_command("PHINF:0A002164EC");
  ASSERT_TRUE(with);
  EXPECT_EQ(with->name, "PHINF");
  EXPECT_EQ(with->parameters, "0A0021");
  EXPECT_TRUE(with->crc_matches);
  const auto without = parse_command("INIT ");
  ASSERT_TRUE(without);
  EXPECT_EQ(without->name, "INIT");
  EXPECT_EQ(without->parameters, "");
}

TEST(ParseCommand, SeesAnyCharacterThatIsWrong) {
  const std::string line = "PENA:0ADAD1E";
  for (std::size_t i = 5; i < line.size(); ++i) {
    std::string damaged = line;
    damaged[i] = '7';
    const auto command = parse_command(damaged);
    EXPECT_TRUE(command && !command->crc_matches) << damaged;
  }
  EXPECT_FALSE(parse_command("PENA:AD")->crc_matches);
}

TEST(ParseCommand, NeedsAName) {
  EXPECT_FALSE(parse_command(""));
  EXPECT_FALSE(parse_command(":E3A5"));
  EXPECT_FALSE(parse_command("INIT"));
}

TEST(LinkParameters, AreReadAsTheyAreWritten) {
  const LinkParameters link{BaudRate::k921600, DataBits::k7, Parity::kEven, StopBits::k2, Handshake::kRtsCts};
  const CommandLine line = comm_command(link);
  EXPECT_EQ(parse_link_parameters(parse_command(line.text().substr(0, line.text().size() - 1))->parameters),
            link);
}

TEST(LinkParameters, OfNoKnownRateOrShapeAreNone) {
  for (const char* parameters :
       {"", "0000", "000000", "80000", "a0000", "02000", "00300", "00020", "00002"}) {
    EXPECT_FALSE(parse_link_parameters(parameters)) << parameters;
  }
}

TEST(BaudRates, AreFoundByTheirBitsPerSecond) {
  for (const int bits : {9600, 14400, 19200, 38400, 57600, 115200, 230400, 921600, 1228739}) {
    ASSERT_TRUE(baud_rate(bits)) << bits;
    EXPECT_EQ(bits_per_second(*baud_rate(bits)), bits);
  }
  EXPECT_FALSE(baud_rate(4800));
}

}  // namespace
}  // namespace tubed::aurora
