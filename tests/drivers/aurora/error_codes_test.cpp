#include "drivers/aurora/error_codes.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

TEST(ErrorCodes, EveryKnownCodeHasItsOwnMeaning) {
  const int known[] = {0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0A, 0x0B, 0x0C, 0x0D,
                       0x0E, 0x0F, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x19, 0x1A, 0x1D,
                       0x1E, 0x1F, 0x20, 0x21, 0x22, 0x23, 0x24, 0x25, 0x28, 0x29, 0x2A, 0x2B, 0x2C,
                       0x2D, 0x2E, 0x2F, 0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39,
                       0x3B, 0x3C, 0x3D, 0x40, 0x41, 0x42, 0xF1, 0xF4, 0xF5, 0xF6};
  std::string_view before;
  for (const int code : known) {
    const auto meaning = describe_error(static_cast<std::uint8_t>(code)).meaning;
    EXPECT_NE(meaning, "unknown error") << std::hex << code;
    EXPECT_NE(meaning, before) << std::hex << code;
    before = meaning;
  }
}

TEST(ErrorCodes, TheLastThreeOfTheListAreTheFlashMemorys) {
  EXPECT_EQ(describe_error(0xF4).meaning, "flash memory cannot be erased");
  EXPECT_EQ(describe_error(0xF5).meaning, "flash memory cannot be written");
  EXPECT_EQ(describe_error(0xF6).meaning, "flash memory cannot be read");
}

TEST(ErrorCodes, ACodeThatNoListHasIsUnknownAndReported) {
  for (const int code : {0x00, 0x18, 0x3A, 0x43, 0xF7, 0xFF}) {
    EXPECT_EQ(describe_error(static_cast<std::uint8_t>(code)).meaning, "unknown error");
    EXPECT_EQ(describe_error(static_cast<std::uint8_t>(code)).remedy, Remedy::kReport);
  }
}

TEST(ErrorCodes, SayWhatHelps) {
  for (const int code : {0x05, 0x1A}) {
    EXPECT_EQ(describe_error(static_cast<std::uint8_t>(code)).remedy, Remedy::kRetry);
  }
  for (const int code : {0x0C, 0x10, 0x2B, 0x2C}) {
    EXPECT_EQ(describe_error(static_cast<std::uint8_t>(code)).remedy, Remedy::kReinitialise);
  }
  EXPECT_EQ(describe_error(0x13).remedy, Remedy::kGiveUpTool);
  EXPECT_EQ(describe_error(0x04).remedy, Remedy::kCheckLink);
  EXPECT_EQ(remedy_text(Remedy::kCheckLink), "check cable and baud rate");
}

}  // namespace
}  // namespace tubed::aurora
