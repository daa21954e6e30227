#include "drivers/laboratory/aurora_emulator/reply_damage.hpp"

#include <array>
#include <utility>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/checksums.hpp"
#include "drivers/aurora/reply.hpp"

namespace tubed::aurora::emulator {

namespace {

using Stream = std::vector<std::uint8_t>;

bool is_binary(const Stream& reply) { return !reply.empty() && reply[0] == kBxStartLow; }

std::ptrdiff_t place(const Stream& reply, Faults& chance) {
  return static_cast<std::ptrdiff_t>(chance.below(reply.size()));
}

/// Another value of one byte: of the check sum's digits or bytes, which lie `from_end` before the end.
void change_check_sum(Stream& reply, std::size_t at) {
  // 0 and 1 are digits of a check sum in characters as well.
  reply[at] = reply[at] == '0' ? '1' : is_binary(reply) ? static_cast<std::uint8_t>(reply[at] ^ 0x55) : '0';
}

void spoil_crc(Stream& reply) {
  constexpr std::size_t kLastTextDigit = 2;  // before the carriage return
  change_check_sum(reply, reply.size() - (is_binary(reply) ? 1 : kLastTextDigit));
}

void spoil_header_crc(Stream& reply) {
  if (is_binary(reply)) {
    change_check_sum(reply, kBxHeaderSize - 1);
  } else {
    spoil_crc(reply);
  }
}

void spoil_length(Stream& reply, Faults& chance) {
  if (!is_binary(reply)) {
    const std::ptrdiff_t at = place(reply, chance);
    reply.insert(reply.begin() + at, reply[static_cast<std::size_t>(at)]);
    return;
  }
  const std::size_t true_length = reply[2] + 256U * reply[3];
  std::size_t length = true_length;
  while (length == true_length) {
    length = chance.below(kMaxBxBody + 1);
  }
  ByteWriter header(std::span<std::uint8_t>(reply).first(kBxHeaderSize));
  header.u8(kBxStartLow);
  header.u8(kBxStartHigh);
  header.u16(static_cast<std::uint16_t>(length));
  header.u16(crc16(header.written()));
}

Stream noise(Faults& chance) {
  Stream bytes(1 + chance.below(20));
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(chance.below(256));
  }
  return bytes;
}

Stream error_reply(std::uint8_t code) {
  std::array<std::uint8_t, 7> payload{};
  ByteWriter writer(payload);
  writer.text("ERROR");
  writer.hex(code, 2);
  Stream reply(payload.size() + 5);
  reply.resize(encode_text_reply(as_text(payload), reply));
  return reply;
}

std::vector<Piece> in_two(const Stream& reply, std::ptrdiff_t at, std::chrono::nanoseconds pause) {
  return {{{}, Stream(reply.begin(), reply.begin() + at)}, {pause, Stream(reply.begin() + at, reply.end())}};
}

}  // namespace

std::vector<Piece> damage_reply(Fault fault, Stream reply, Bytes last_tracking, Faults& chance) {
  switch (fault) {
    case Fault::kCrc:
      spoil_crc(reply);
      break;
    case Fault::kHeaderCrc:
      spoil_header_crc(reply);
      break;
    case Fault::kLength:
      spoil_length(reply, chance);
      break;
    case Fault::kTruncate:
      reply.resize(chance.below(reply.size()));
      break;
    case Fault::kDrop:
      reply.erase(reply.begin() + place(reply, chance));
      break;
    case Fault::kGarbage: {
      const Stream before = noise(chance);
      reply.insert(reply.begin(), before.begin(), before.end());
      break;
    }
    case Fault::kNoReply:
      return {};
    case Fault::kError:
      return {{{}, error_reply(chance.amounts.error_code)}};
    case Fault::kDuplicate:
      return {{{}, reply}, {{}, reply}};
    case Fault::kStale:
      if (!last_tracking.empty()) {
        reply.assign(last_tracking.begin(), last_tracking.end());
      }
      break;
    case Fault::kDelay:
      return {{chance.amounts.delay, std::move(reply)}};
    case Fault::kSplit:
      return in_two(reply, place(reply, chance), chance.amounts.split);
    default:
      break;
  }
  std::vector<Piece> pieces;
  pieces.push_back({{}, std::move(reply)});
  return pieces;
}

}  // namespace tubed::aurora::emulator
