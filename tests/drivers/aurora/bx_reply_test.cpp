#include "drivers/aurora/bx_reply.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "drivers/aurora/checksums.hpp"
#include "tests/drivers/aurora/drawn_replies.hpp"
#include "tests/drivers/aurora/hex_bytes.hpp"

namespace tubed::aurora {
namespace {

// Sent by a real tracker (a Polaris, whose BX has the same layout) in answer to BX:0001.
const char* const kRecorded =
    "c4a537003b23 02 01023100000028010000"
    "02017f280f3f80121d3f201dc63ea280cd3e1c78b1c2d8d42443c87f09c5c55f0a3d310000002a010000 0000 07a1";

TrackingReply decoded_frame(const std::vector<std::uint8_t>& frame) {
  Bytes body;
  EXPECT_EQ(frame_bx(frame, body), BxFrame::kComplete);
  TrackingReply reply;
  EXPECT_TRUE(decode_bx(body, reply));
  return reply;
}

bool refused(std::string_view hex) {
  const std::vector<std::uint8_t> body = bytes_of(hex);
  TrackingReply reply;
  return !decode_bx(body, reply);
}

TEST(BxReply, ReadsWhatARealTrackerSent) {
  const TrackingReply reply = decoded_frame(bytes_of(kRecorded));
  ASSERT_EQ(reply.handle_count, 2);
  EXPECT_EQ(reply.handles[0].handle, 1);
  EXPECT_EQ(reply.handles[0].report, Report::kMissing);
  EXPECT_EQ(reply.handles[0].port_status.bits, 0x31U);
  EXPECT_EQ(reply.handles[0].frame, 0x128U);
  const HandleReading& valid = reply.handles[1];
  EXPECT_EQ(valid.handle, 2);
  EXPECT_EQ(valid.report, Report::kValid);
  EXPECT_NEAR(valid.rotation.q0, 0.559212, 1e-6);
  EXPECT_NEAR(valid.rotation.qz, 0.401372, 1e-6);
  EXPECT_NEAR(valid.p_em_mm.x(), -88.7346, 1e-4);
  EXPECT_NEAR(valid.p_em_mm.y(), 164.8314, 1e-4);
  EXPECT_NEAR(valid.p_em_mm.z(), -2199.9863, 1e-4);
  EXPECT_EQ(valid.frame, 0x12AU);
  EXPECT_EQ(reply.system_status.bits, 0);
}

TEST(BxReply, IsWrittenAsARealTrackerWrites) {
  const std::vector<std::uint8_t> recorded = bytes_of(kRecorded);
  EXPECT_EQ(as_bx(decoded_frame(recorded)), recorded);
}

TEST(BxReply, OfADisabledHandleCarriesNothing) {
  const std::vector<std::uint8_t> body = bytes_of("02 0A04 0B02 3F000000 10000000 8000");
  TrackingReply reply;
  ASSERT_TRUE(decode_bx(body, reply));
  EXPECT_EQ(reply.handles[0].report, Report::kDisabled);
  EXPECT_EQ(reply.handles[1].handle, 0x0B);
  EXPECT_EQ(reply.handles[1].frame, 16U);
  EXPECT_TRUE(reply.system_status.port_became_unoccupied());
}

TEST(BxReply, IsRefusedUnlessEveryByteIsAccountedFor) {
  EXPECT_FALSE(refused("01 0A02 3F000000 10000000 0000"));
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused("01"));
  EXPECT_TRUE(refused("01 0A02 3F000000 10000000 00"));
  EXPECT_TRUE(refused("01 0A02 3F000000 10000000 000000"));
  EXPECT_TRUE(refused("02 0A02 3F000000 10000000 0000"));
  EXPECT_TRUE(refused("01 0A03 3F000000 10000000 0000"));  // a status that is none
  EXPECT_TRUE(refused("01 0A00 3F000000 10000000 0000"));
  EXPECT_TRUE(refused("FF 0A04 0000"));
}

TEST(BxReply, OfNumbersThatAreNoPoseIsImplausibleForItsHandleOnly) {
  DrawnReplies drawn(3);
  TrackingReply reply = drawn.reply(2, 8);
  for (auto& reading : {&reply.handles[0], &reply.handles[1]}) {
    reading->report = Report::kValid;
    reading->rotation = {1, 0, 0, 0};
    reading->p_em_mm = {1, 2, 3};
    reading->indicator = 0;
  }
  reply.handles[0].p_em_mm.y() = -3.697314e28;  // as trackers write "no number"
  const TrackingReply received = decoded_frame(as_bx(reply));
  EXPECT_EQ(received.handles[0].report, Report::kImplausible);
  EXPECT_TRUE(received.handles[0].p_em_mm.hasNaN());
  EXPECT_EQ(received.handles[1].report, Report::kValid);
}

TEST(BxReply, SurvivesWritingAndReading) {
  DrawnReplies drawn(2);
  for (int k = 0; k < 2000; ++k) {
    const TrackingReply sent = drawn.reply(k % (kMaxHandles + 1), 8U * static_cast<std::uint32_t>(k));
    ASSERT_TRUE(same_reply(sent, decoded_frame(as_bx(sent)))) << k;
  }
}

TEST(BxReply, IsNotWrittenWhenThereIsNoRoom) {
  const TrackingReply reply = DrawnReplies(4).reply(5, 8);
  const std::size_t size = as_bx(reply).size();
  for (std::size_t room = 0; room < size; ++room) {
    std::vector<std::uint8_t> exact(room);
    EXPECT_EQ(encode_bx(reply, exact), 0U) << room;
  }
}

TEST(BxFrame, WaitsForEveryByteBeforeItsLast) {
  const std::vector<std::uint8_t> whole = bytes_of(kRecorded);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::vector<std::uint8_t> exact(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    Bytes body;
    EXPECT_EQ(frame_bx(exact, body), BxFrame::kNeedsMore) << size;
  }
}

TEST(BxFrame, SaysWhichCheckSumIsWrong) {
  const auto damaged = [](std::size_t at) {
    std::vector<std::uint8_t> bytes = bytes_of(kRecorded);
    bytes[at] ^= 0x40;
    Bytes body;
    return frame_bx(bytes, body);
  };
  EXPECT_EQ(damaged(0), BxFrame::kBadStart);
  EXPECT_EQ(damaged(1), BxFrame::kBadStart);
  for (std::size_t at = 2; at < kBxHeaderSize; ++at) {
    EXPECT_EQ(damaged(at), BxFrame::kBadHeader) << at;
  }
  for (std::size_t at = kBxHeaderSize; at < bytes_of(kRecorded).size(); ++at) {
    EXPECT_EQ(damaged(at), BxFrame::kBadBody) << at;
  }
}

TEST(BxFrame, OfTwoRepliesUnderOneLengthIsNoneThoughTheCheckSumIsRight) {
  // Two frames, and a header and a frame, run to a check sum of 0 as one frame does.
  const std::vector<std::uint8_t> reply = bytes_of(kRecorded);
  std::vector<std::uint8_t> both = reply;
  both[2] = static_cast<std::uint8_t>(2 * reply.size() - kBxHeaderSize - kBxCrcSize);
  const std::uint16_t crc = crc16(Bytes(both).first(4));
  both[4] = static_cast<std::uint8_t>(crc);
  both[5] = static_cast<std::uint8_t>(crc >> 8);
  both.insert(both.end(), reply.begin(), reply.end());
  ASSERT_EQ(crc16(both), 0);
  Bytes body;
  EXPECT_EQ(frame_bx(both, body), BxFrame::kBadBody);
}

TEST(BxFrame, OfALengthThatNoReplyHasIsNotWaitedFor) {
  std::vector<std::uint8_t> header = bytes_of("C4A5 FFFF");
  const std::uint16_t crc = crc16(Bytes(header));
  header.push_back(static_cast<std::uint8_t>(crc));
  header.push_back(static_cast<std::uint8_t>(crc >> 8));
  Bytes body;
  EXPECT_EQ(frame_bx(header, body), BxFrame::kBadHeader);
}

}  // namespace
}  // namespace tubed::aurora
