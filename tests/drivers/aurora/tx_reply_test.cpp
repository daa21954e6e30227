#include "drivers/aurora/tx_reply.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/drivers/aurora/drawn_replies.hpp"
#include "tests/drivers/aurora/hex_bytes.hpp"

namespace tubed::aurora {
namespace {

const std::string kPose = "+08157-00068+05783+00000-004931+000573-016557+00123";
const std::string kValidHandle = "0A" + kPose + "0000003F00000018\n";

TrackingReply decoded(const std::string& payload) {
  TrackingReply reply;
  EXPECT_TRUE(decode_tx(payload, reply)) << payload;
  return reply;
}

bool refused(const std::string& payload) {
  TrackingReply reply;
  return !decode_tx(payload, reply);
}

TEST(TxReply, GivesThePoseOfAHandleInItsUnits) {
  ASSERT_EQ(kValidHandle.size(), 70U);
  const TrackingReply reply = decoded("01" + kValidHandle + "0000");
  ASSERT_EQ(reply.handle_count, 1);
  const HandleReading& reading = reply.handles[0];
  EXPECT_EQ(reading.handle, 0x0A);
  EXPECT_EQ(reading.report, Report::kValid);
  EXPECT_DOUBLE_EQ(reading.rotation.q0, 0.8157);
  EXPECT_DOUBLE_EQ(reading.rotation.qx, -0.0068);
  EXPECT_DOUBLE_EQ(reading.rotation.qy, 0.5783);
  EXPECT_EQ(reading.rotation.qz, 0);
  EXPECT_DOUBLE_EQ(reading.p_em_mm.x(), -49.31);
  EXPECT_DOUBLE_EQ(reading.p_em_mm.y(), 5.73);
  EXPECT_DOUBLE_EQ(reading.p_em_mm.z(), -165.57);
  EXPECT_DOUBLE_EQ(reading.indicator, 0.0123);
  EXPECT_EQ(reading.port_status.bits, 0x3FU);
  EXPECT_EQ(reading.frame, 0x18U);
}

TEST(TxReply, KnowsEveryWordInPlaceOfAPose) {
  const TrackingReply reply = decoded(
      "040AMISSING0000003F00000000\n0BDISABLED\n0CUNOCCUPIED\n"
      "0D" +
      kPose + "0000003F00000018\n00C0");
  ASSERT_EQ(reply.handle_count, 4);
  EXPECT_EQ(reply.handles[0].report, Report::kMissing);
  EXPECT_EQ(reply.handles[0].port_status.bits, 0x3FU);
  EXPECT_EQ(reply.handles[1].report, Report::kDisabled);
  EXPECT_EQ(reply.handles[2].report, Report::kUnoccupied);
  EXPECT_EQ(reply.handles[3].report, Report::kValid);
  EXPECT_TRUE(reply.system_status.port_became_unoccupied());
}

TEST(TxReply, AMissingHandleHasNoPose) {
  const HandleReading reading = decoded("010AMISSING0000007F00000018\n0000").handles[0];
  EXPECT_TRUE(reading.p_em_mm.hasNaN());
  EXPECT_TRUE(reading.port_status.out_of_volume());
}

TEST(TxReply, MayEndWithOrWithoutALineFeed) {
  EXPECT_EQ(decoded("010BDISABLED\n0001").system_status.bits, 1);
  EXPECT_EQ(decoded("010BDISABLED0001").system_status.bits, 1);
  EXPECT_EQ(decoded("010BDISABLED\n0001\n").system_status.bits, 1);
  EXPECT_EQ(decoded("000000").handle_count, 0);
}

TEST(TxReply, ADisabledHandleMayHaveAStatus) {
  const TrackingReply reply = decoded("020ADISABLED0000000100000000\n0BMISSING0000003F00000008\n0000");
  EXPECT_EQ(reply.handles[0].report, Report::kDisabled);
  EXPECT_EQ(reply.handles[1].frame, 8U);
}

TEST(TxReply, IsRefusedWhenAnyFieldIsNotAsItShouldBe) {
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused("0"));
  EXPECT_TRUE(refused("01"));
  EXPECT_TRUE(refused("FF" + kValidHandle + "0000"));
  EXPECT_TRUE(refused("02" + kValidHandle + "0000"));
  EXPECT_TRUE(refused("01" + kValidHandle));
  EXPECT_TRUE(refused("01" + kValidHandle + "00000"));
  EXPECT_TRUE(refused("010A+0815" + kPose + "0000003F00000018\n0000"));
  EXPECT_TRUE(refused("010AMISSIN0000003F00000018\n0000"));
  EXPECT_TRUE(refused("020AMISSING0000003F000000180BDISABLED\n0000"));  // no line feed between two
}

TEST(TxReply, IsRefusedAtEveryLengthButItsOwn) {
  const std::string whole = "02" + kValidHandle + "0BMISSING0000003F00000018\n0000";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::vector<char> exact(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    TrackingReply reply;
    EXPECT_FALSE(decode_tx({exact.data(), exact.size()}, reply)) << size;
  }
}

TEST(TxReply, ANumberThatIsNoPoseIsImplausibleForItsHandleOnly) {
  const std::string wrong = "0B+99999" + kPose.substr(6) + "0000003F00000018\n";
  const TrackingReply reply = decoded("02" + kValidHandle + wrong + "0000");
  EXPECT_EQ(reply.handles[0].report, Report::kValid);
  EXPECT_EQ(reply.handles[1].report, Report::kImplausible);
}

TEST(TxReply, IsWrittenAsItIsRead) {
  const std::string payload = "03" + kValidHandle + "0BDISABLED\n0CMISSING0000003F00000018\n0080";
  std::vector<std::uint8_t> room(300);
  room.resize(encode_tx(decoded(payload), room));
  EXPECT_EQ(as_text(room), payload);
}

TEST(TxReply, SurvivesWritingAndReading) {
  DrawnReplies drawn(1);
  for (int k = 0; k < 2000; ++k) {
    const TrackingReply sent = drawn.reply(k % (kMaxHandles + 1), 8U * static_cast<std::uint32_t>(k));
    std::vector<std::uint8_t> payload(4096);
    payload.resize(encode_tx(sent, payload));
    TrackingReply received;
    ASSERT_TRUE(decode_tx(as_text(payload), received)) << as_text(payload);
    ASSERT_TRUE(same_reply(sent, received, 1e-9)) << as_text(payload);
  }
}

TEST(TxReply, IsNotWrittenWithNumbersThatDoNotFit) {
  TrackingReply reply = decoded("01" + kValidHandle + "0000");
  std::vector<std::uint8_t> room(200);
  reply.handles[0].p_em_mm.x() = 10'000;
  EXPECT_EQ(encode_tx(reply, room), 0U);
  reply.handles[0].p_em_mm.x() = HandleReading::kNaN;
  EXPECT_EQ(encode_tx(reply, room), 0U);
  reply.handles[0].p_em_mm.x() = 0;
  EXPECT_EQ(encode_tx(reply, std::span(room).first(75)), 0U);
  EXPECT_EQ(encode_tx(reply, std::span(room).first(76)), 76U);
}

}  // namespace
}  // namespace tubed::aurora
