#include "tests/second_aurora/mischief.hpp"

#include <algorithm>
#include <utility>

namespace tubed::second_aurora {

namespace {

constexpr std::size_t kHeaderBytes = 6;

bool is_of_measurements(FaultKind kind) { return kind >= FaultKind::CoilMissing; }

bool can_strike(FaultKind kind, const ReplyKind& reply) {
  switch (kind) {
    case FaultKind::HeaderCrcWrong:
    case FaultKind::LengthWrong:
    case FaultKind::TextForBinary:
      return reply.binary;
    case FaultKind::Stale:
      return reply.has_previous;
    default:
      return true;
  }
}

void write_u16(Bytes& bytes, std::size_t at, unsigned value) {
  bytes[at] = static_cast<std::uint8_t>(value & 0xFF);
  bytes[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

}  // namespace

Mischief::Mischief(std::vector<Fault> faults, std::uint64_t seed)
    : faults_(std::move(faults)), random_(seed) {}

double Mischief::uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

std::size_t Mischief::below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }

bool Mischief::strikes(Fault& fault) {
  if (fault.next > 0) {
    --fault.next;
  } else if (fault.probability <= 0 || uniform() >= fault.probability) {
    return false;
  }
  ++struck_[static_cast<std::size_t>(fault.kind)];
  return true;
}

std::optional<Fault> Mischief::on_reply(const ReplyKind& reply) {
  for (Fault& fault : faults_) {
    if (is_of_measurements(fault.kind) || !can_strike(fault.kind, reply) ||
        (fault.strikes == Strikes::TrackingReplies && !reply.tracking)) {
      continue;
    }
    if (strikes(fault)) {
      return fault;
    }
  }
  return std::nullopt;
}

std::vector<Fault> Mischief::on_measurement() {
  std::vector<Fault> beginning;
  for (Fault& fault : faults_) {
    if (is_of_measurements(fault.kind) && strikes(fault)) {
      beginning.push_back(fault);
    }
  }
  return beginning;
}

Bytes Mischief::damaged(const Fault& fault, const Bytes& reply) {
  Bytes bytes = reply;
  const bool binary = bytes.size() > kHeaderBytes && bytes[0] == 0xC4 && bytes[1] == 0xA5;
  switch (fault.kind) {
    case FaultKind::BodyCrcWrong: {
      // One bit of what the CRC protects: in text everything, in a binary reply the body.
      const std::size_t from = binary ? kHeaderBytes : 0;
      const std::size_t protected_bytes = bytes.size() - from - (binary ? 2 : 5);
      bytes[from + below(std::max<std::size_t>(protected_bytes, 1))] ^=
          static_cast<std::uint8_t>(1u << below(7));
      break;
    }
    case FaultKind::HeaderCrcWrong:
      bytes[4 + below(2)] ^= static_cast<std::uint8_t>(1u << below(8));
      break;
    case FaultKind::LengthWrong: {
      // The header's CRC is right: only the body's can tell.
      const unsigned length = static_cast<unsigned>(bytes[2] | bytes[3] << 8);
      const unsigned wrong = below(2) == 0
                                 ? length + 1 + static_cast<unsigned>(below(60))
                                 : length - 1 - static_cast<unsigned>(below(std::max(length, 2u) - 1));
      write_u16(bytes, 2, wrong);
      write_u16(bytes, 4, crc16(std::span(bytes).first(4)));
      break;
    }
    case FaultKind::Truncated:
      bytes.resize(1 + below(bytes.size() - 1));
      break;
    case FaultKind::ByteDropped:
      bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size())));
      break;
    case FaultKind::NoiseBefore: {
      const std::size_t count =
          fault.parameter > 0 ? static_cast<std::size_t>(fault.parameter) : 1 + below(20);
      for (std::size_t i = 0; i < count; ++i) {
        bytes.insert(bytes.begin(), noise());
      }
      break;
    }
    case FaultKind::NoReply:
      bytes.clear();
      break;
    case FaultKind::ErrorInstead:
      bytes = framed("ERROR" + hex(static_cast<unsigned>(fault.parameter > 0 ? fault.parameter : 0x1A), 2));
      break;
    case FaultKind::Duplicated:
      bytes.insert(bytes.end(), reply.begin(), reply.end());
      break;
    default:
      break;
  }
  return bytes;
}

}  // namespace tubed::second_aurora
