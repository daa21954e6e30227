// Any bytes, cut anywhere, through the reader of replies and the decoders of what it finds.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/reply_reader.hpp"
#include "drivers/aurora/tx_reply.hpp"

using namespace tubed::aurora;

namespace {

void demand(bool held) {
  if (!held) {
    std::abort();
  }
}

/// A pose that is handed on is one, and a reply is read again as it was written.
void check_tracking(const TrackingReply& reply, ReplyKind kind) {
  demand(reply.handle_count >= 0 && reply.handle_count <= kMaxHandles);
  for (const HandleReading& reading : reply.readings()) {
    demand(reading.report != Report::kValid || plausible_pose(reading));
    const tubed::CoilSample sample = coil_sample(reading);
    demand(sample.status != tubed::CoilStatus::kOk || std::abs(sample.tangent_em.norm() - 1) < 1e-9);
  }
  std::vector<std::uint8_t> room(4096);
  TrackingReply again;
  if (kind == ReplyKind::kBinary) {
    room.resize(encode_bx(reply, room));
    Bytes body;
    demand(frame_bx(room, body) == BxFrame::kComplete && decode_bx(body, again));
  } else {
    room.resize(encode_tx(reply, room));
    demand(decode_tx(as_text(room), again));
  }
  demand(again.handle_count == reply.handle_count && again.system_status.bits == reply.system_status.bits);
}

void check_reply(const Reply& reply) {
  TrackingReply tracking;
  if (reply.kind == ReplyKind::kBinary ? decode_bx(reply.payload, tracking)
                                       : decode_tx(reply.text(), tracking)) {
    check_tracking(tracking, reply.kind);
  }
}

}  // namespace

// The first byte says into pieces of what size the rest is cut.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::size_t piece = data[0] % 64 + 1U;
  const Bytes stream(data + 1, size - 1);
  static ReplyReader reader;
  reader = ReplyReader();
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    // A copy of its own, so that a look past its end is seen.
    const Bytes view = stream.subspan(at, std::min(piece, stream.size() - at));
    const std::vector<std::uint8_t> chunk(view.begin(), view.end());
    demand(reader.feed(chunk) == chunk.size());
    while (const auto reply = reader.next()) {
      check_reply(*reply);
    }
    demand(reader.room() > 0);
  }
  while (reader.waiting() > 0) {
    const std::size_t before = reader.waiting();
    reader.give_up_waiting();
    demand(reader.waiting() < before);
    while (const auto reply = reader.next()) {
      check_reply(*reply);
    }
  }
  return 0;
}
