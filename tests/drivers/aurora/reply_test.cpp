#include "drivers/aurora/reply.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/drivers/aurora/hex_bytes.hpp"

namespace tubed::aurora {
namespace {

TEST(TextReply, KnowsTheFixedWords) {
  EXPECT_EQ(decode_text_reply("OKAYA896")->kind, ReplyKind::kOkay);
  EXPECT_EQ(decode_text_reply("RESETBE6F")->kind, ReplyKind::kReset);
  EXPECT_EQ(decode_text_reply("WARNING7423")->kind, ReplyKind::kWarning);
}

TEST(TextReply, GivesTheCodeOfAnError) {
  const auto reply = decode_text_reply("ERROR133A42");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->kind, ReplyKind::kError);
  EXPECT_EQ(reply->error_code, 0x13);
}

TEST(TextReply, IsTextWhenItOnlyBeginsLikeAWord) {
  std::array<std::uint8_t, 64> room{};
  for (const char* payload : {"ERROR", "ERRORXY", "ERROR123", "OKAYOKAY", "WARNINGS", "RESET0", "0"}) {
    const std::size_t size = encode_text_reply(payload, room);
    const auto reply = decode_text_reply(as_text(Bytes(room).first(size - 1)));
    ASSERT_TRUE(reply) << payload;
    EXPECT_EQ(reply->kind, ReplyKind::kText) << payload;
    EXPECT_EQ(reply->text(), payload);
  }
}

TEST(TextReply, WithAWrongCheckSumOrNoPayloadIsNone) {
  for (const char* line : {"", "0000", "OKAYA897", "OKAYA89", "OKAY", "OKAY A896", "OKAYA8 6", "okayA896"}) {
    EXPECT_FALSE(decode_text_reply(line)) << line;
  }
}

TEST(TextReply, KeepsLineFeedsInItsPayload) {
  std::array<std::uint8_t, 64> room{};
  const std::size_t size = encode_text_reply("one\ntwo\n", room);
  EXPECT_EQ(decode_text_reply(as_text(Bytes(room).first(size - 1)))->text(), "one\ntwo\n");
}

TEST(TextReply, IsNotWrittenWhenThereIsNoRoom) {
  std::array<std::uint8_t, 8> room{};
  EXPECT_EQ(encode_text_reply("OKAY", room), 0U);
}

TEST(WordAtEnd, IsFoundBehindNoise) {
  EXPECT_EQ(decode_word_at_end("x7,OKAYA896")->kind, ReplyKind::kOkay);
  EXPECT_EQ(decode_word_at_end("BX:ERROR133A42")->error_code, 0x13);
  EXPECT_EQ(decode_word_at_end("~RESETBE6F")->kind, ReplyKind::kReset);
  EXPECT_FALSE(decode_word_at_end("OKAYA896x"));
  EXPECT_FALSE(decode_word_at_end("0001414"));  // a right check sum, but no word
}

}  // namespace
}  // namespace tubed::aurora
