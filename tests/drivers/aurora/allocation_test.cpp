// Reading replies and frames happens where nothing may allocate.
#include <gtest/gtest.h>

#include "drivers/aurora/can_coil_assembler.hpp"
#include "drivers/aurora/reply_reader.hpp"
#include "tests/drivers/aurora/drawn_replies.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed::aurora {
namespace {

TEST(Allocation, IsSeenByThisTest) {
  const long before = allocations;
  const std::vector<int> numbers(100);
  EXPECT_GT(allocations, before);
}

TEST(Allocation, DoesNotHappenWhileRepliesAreRead) {
  const TrackingReply sent = DrawnReplies(1).reply(8, 8);
  const auto bx = as_bx(sent);
  const auto tx = as_tx(sent);
  ReplyReader reader;
  TrackingReply received;
  int read = 0;
  const long before = allocations;
  for (const Bytes stream : {Bytes(bx), Bytes(tx), Bytes(bx).first(30), Bytes(bx)}) {
    reader.feed(stream);
    while (const auto reply = reader.next()) {
      read += reply->kind == ReplyKind::kBinary ? decode_bx(reply->payload, received)
                                                : decode_tx(reply->text(), received);
    }
  }
  EXPECT_EQ(allocations, before);
  EXPECT_EQ(read, 3);
}

TEST(Allocation, DoesNotHappenWhileCanFramesArePutTogether) {
  CanCoilAssembler assembler(1);
  HandleReading reading;
  reading.report = Report::kValid;
  reading.rotation = {1, 0, 0, 0};
  reading.p_em_mm = {1, 2, 3};
  reading.indicator = 0;
  const long before = allocations;
  bool left = false;
  left |= assembler.accept(pack_sync({8, 0}), {}).has_value();
  for (const CanFrame& frame : pack_classic_coil(0, reading, {8, 0})) {
    left |= assembler.accept(frame, {}).has_value();
  }
  EXPECT_EQ(allocations, before);
  EXPECT_TRUE(left);
}

}  // namespace
}  // namespace tubed::aurora
