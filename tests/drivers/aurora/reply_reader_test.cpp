#include "drivers/aurora/reply_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "drivers/aurora/checksums.hpp"
#include "tests/drivers/aurora/drawn_replies.hpp"
#include "tests/drivers/aurora/hex_bytes.hpp"

namespace tubed::aurora {
namespace {

using Stream = std::vector<std::uint8_t>;

Stream operator+(Stream first, const Stream& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

Stream stream_of(std::string_view text) {
  const Bytes bytes = as_bytes(text);
  return {bytes.begin(), bytes.end()};
}

const Stream kOkay = stream_of("OKAYA896\r");

/// What a reader found in `stream`, fed `chunk` bytes at a time: "okay", "13", "bx", or the text.
std::vector<std::string> found_in(ReplyReader& reader, const Stream& stream, std::size_t chunk) {
  std::vector<std::string> found;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t taken = reader.feed(Bytes(stream).subspan(at, std::min(chunk, stream.size() - at)));
    EXPECT_GT(taken, 0U);
    at += taken;
    while (const auto reply = reader.next()) {
      found.push_back(reply->kind == ReplyKind::kBinary ? "bx" : std::string(reply->text()));
    }
  }
  return found;
}

using Found = std::vector<std::string>;

TEST(ReplyReader, FindsRepliesHoweverTheyAreCut) {
  const Stream bx = as_bx(DrawnReplies(1).reply(5, 8));
  const Stream stream = kOkay + bx + stream_of("ERROR133A42\r") + bx + bx + stream_of("01414\r001414\r");
  for (std::size_t chunk = 1; chunk <= stream.size(); chunk += chunk < 40 ? 1 : 37) {
    ReplyReader reader;
    EXPECT_EQ(found_in(reader, stream, chunk), (Found{"OKAY", "bx", "ERROR13", "bx", "bx", "00"})) << chunk;
    EXPECT_EQ(reader.counts().replies, 6U);
    EXPECT_EQ(reader.counts().discarded_bytes, 6U);  // "01414\r", whose check sum is that of "0" with a 1400
    EXPECT_EQ(reader.waiting(), 0U);
  }
}

TEST(ReplyReader, TakesAnErrorWhereABinaryReplyWasAskedFor) {
  ReplyReader reader;
  reader.feed(as_bytes("ERROR133A42\r"));
  const auto reply = reader.next();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->kind, ReplyKind::kError);
  EXPECT_EQ(reply->error_code, 0x13);
}

TEST(ReplyReader, GivesTheBodyOfABinaryReply) {
  const TrackingReply sent = DrawnReplies(2).reply(4, 88);
  ReplyReader reader;
  reader.feed(as_bx(sent));
  const auto reply = reader.next();
  ASSERT_TRUE(reply);
  TrackingReply received;
  ASSERT_TRUE(decode_bx(reply->payload, received));
  EXPECT_TRUE(same_reply(sent, received));
}

TEST(ReplyReader, StepsOverWhatBelongsToNoReply) {
  const Stream bx = as_bx(DrawnReplies(3).reply(5, 8));
  for (const char* noise :
       {"00", "FF FF 00", "C4", "C4 C4", "C4 A5 00", "C4 A5 10 00 12 34", "0D", "41 42 0D", "A5 C4"}) {
    ReplyReader reader;
    const Stream before = bytes_of(noise);
    EXPECT_EQ(found_in(reader, before + bx, 7), Found{"bx"}) << noise;
    EXPECT_EQ(reader.counts().discarded_bytes, before.size()) << noise;
    EXPECT_EQ(found_in(reader, before + kOkay, 7), Found{"OKAY"}) << noise;
  }
}

TEST(ReplyReader, FindsAFixedWordBehindStrayCharacters) {
  ReplyReader reader;
  EXPECT_EQ(found_in(reader, stream_of("7g.RESETBE6F\r"), 5), Found{"RESET"});
  EXPECT_EQ(reader.counts().discarded_bytes, 3U);
}

TEST(ReplyReader, LosesOnlyTheReplyThatIsDamaged) {
  const Stream bx = as_bx(DrawnReplies(4).reply(5, 8));
  for (std::size_t at = 0; at < bx.size(); ++at) {
    Stream damaged = bx;
    damaged[at] ^= 0x55;
    ReplyReader reader;
    EXPECT_EQ(found_in(reader, damaged + bx + bx, 64), (Found{"bx", "bx"})) << at;
    EXPECT_EQ(reader.counts().discarded_bytes, bx.size()) << at;
  }
}

TEST(ReplyReader, FindsTheNextReplyInsideWhatACutOneClaims) {
  const Stream bx = as_bx(DrawnReplies(5).reply(5, 8));
  for (std::size_t size = 0; size < bx.size(); ++size) {
    const Stream cut(bx.begin(), bx.begin() + static_cast<std::ptrdiff_t>(size));
    ReplyReader reader;
    EXPECT_EQ(found_in(reader, cut + bx, 1), Found{"bx"}) << size;
    EXPECT_EQ(reader.counts().discarded_bytes, size);
  }
}

TEST(ReplyReader, FindsAShortReplyInsideACutOneOnceItStopsWaiting) {
  const Stream bx = as_bx(DrawnReplies(6).reply(5, 8));
  const Stream cut(bx.begin(), bx.begin() + 100);
  ReplyReader reader;
  EXPECT_EQ(found_in(reader, cut + kOkay, 16), Found{});
  reader.give_up_waiting();
  const auto reply = reader.next();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->kind, ReplyKind::kOkay);
}

TEST(ReplyReader, LosesOnlyTheLineThatIsDamaged) {
  const Stream tx = as_tx(DrawnReplies(7).reply(4, 8));
  const std::string payload = text_of(Bytes(tx).first(tx.size() - 5));
  for (std::size_t at = 0; at + 1 < tx.size(); ++at) {
    Stream damaged = tx;
    damaged[at] ^= 0x11;
    ReplyReader reader;
    EXPECT_EQ(found_in(reader, damaged + tx, 50), Found{payload}) << at;
  }
}

TEST(ReplyReader, HoldsNoMoreThanItsCapacityOfTextWithoutAnEnd) {
  ReplyReader reader;
  const Stream endless(10 * ReplyReader::kCapacity, 'x');
  EXPECT_EQ(found_in(reader, endless, 1000), Found{});
  EXPECT_GE(reader.counts().overlong, 9U);
  EXPECT_EQ(found_in(reader, stream_of("\r") + kOkay, 100), Found{"OKAY"});
}

TEST(ReplyReader, TakesNoMoreThanItHasRoomFor) {
  ReplyReader reader;
  const Stream endless(ReplyReader::kCapacity + 1, 'x');
  EXPECT_EQ(reader.feed(endless), ReplyReader::kCapacity);
  EXPECT_EQ(reader.feed(endless), 0U);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.room(), ReplyReader::kCapacity);
}

TEST(ReplyReader, ForgetsAnEarlierAnswerWhenCleared) {
  ReplyReader reader;
  reader.feed(as_bytes("OKAYA8"));
  reader.clear();
  reader.feed(as_bytes("96\r"));
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.counts().discarded_bytes, 9U);
}

TEST(ReplyReader, CountsWhatItRefused) {
  const Stream bx = as_bx(DrawnReplies(8).reply(3, 8));
  Stream bad_header = bx;
  bad_header[2] ^= 1;
  Stream bad_body = bx;
  bad_body[20] ^= 1;
  ReplyReader reader;
  EXPECT_EQ(found_in(reader, bad_header + bx + bad_body + bx + stream_of("OKAYA897\r"), 32),
            (Found{"bx", "bx"}));
  EXPECT_EQ(reader.counts().bad_headers, 1U);
  EXPECT_EQ(reader.counts().bad_bodies, 1U);
  EXPECT_GE(reader.counts().bad_text, 1U);
}

TEST(ReplyReader, EveryByteIsInAReplyDiscardedOrWaiting) {
  DrawnReplies drawn(9);
  for (int k = 0; k < 500; ++k) {
    ReplyReader reader;
    std::size_t in_replies = 0;
    std::size_t fed = 0;
    for (int piece = 0; piece < 20; ++piece) {
      Stream stream = drawn.below(2) == 0 ? as_bx(drawn.reply(2, 8)) : kOkay;
      stream[drawn.below(static_cast<std::uint32_t>(stream.size()))] = drawn.byte();
      fed += reader.feed(stream);
      while (const auto reply = reader.next()) {
        const bool binary = reply->kind == ReplyKind::kBinary;
        in_replies += reply->payload.size() + (binary ? kBxHeaderSize + kBxCrcSize : 5);
      }
    }
    ASSERT_EQ(in_replies + reader.counts().discarded_bytes + reader.waiting(), fed);
  }
}

}  // namespace
}  // namespace tubed::aurora
