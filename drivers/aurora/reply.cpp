#include "drivers/aurora/reply.hpp"

#include <initializer_list>

#include "drivers/aurora/checksums.hpp"

namespace tubed::aurora {

namespace {

constexpr std::size_t kCrcDigits = 4;
constexpr std::string_view kOkay = "OKAY";
constexpr std::string_view kReset = "RESET";
constexpr std::string_view kError = "ERROR";
constexpr std::string_view kWarning = "WARNING";

/// Two hexadecimal digits that follow `word` and end `payload`.
std::optional<std::uint32_t> code_after(std::string_view word, std::string_view payload) noexcept {
  const bool shaped = payload.size() == word.size() + 2 && payload.substr(0, word.size()) == word;
  return shaped ? parse_hex(payload.substr(word.size())) : std::nullopt;
}

Reply read_payload(std::string_view payload) noexcept {
  Reply reply{ReplyKind::kText, 0, as_bytes(payload)};
  if (payload == kOkay) {
    reply.kind = ReplyKind::kOkay;
  } else if (payload == kReset) {
    reply.kind = ReplyKind::kReset;
  } else if (payload == kWarning || code_after(kWarning, payload)) {
    reply.kind = ReplyKind::kWarning;
  } else if (const auto code = code_after(kError, payload)) {
    reply.kind = ReplyKind::kError;
    reply.error_code = static_cast<std::uint8_t>(*code);
  }
  return reply;
}

}  // namespace

std::optional<Reply> decode_text_reply(std::string_view line) noexcept {
  if (line.size() <= kCrcDigits) {
    return std::nullopt;
  }
  const std::string_view payload = line.substr(0, line.size() - kCrcDigits);
  if (parse_hex(line.substr(payload.size())) != crc16(payload)) {
    return std::nullopt;
  }
  return read_payload(payload);
}

std::optional<Reply> decode_word_at_end(std::string_view line) noexcept {
  for (const std::size_t size :
       {kOkay.size(), kReset.size(), kError.size() + 2, kWarning.size(), kWarning.size() + 2}) {
    if (line.size() < size + kCrcDigits) {
      continue;
    }
    const auto reply = decode_text_reply(line.substr(line.size() - size - kCrcDigits));
    if (reply && reply->kind != ReplyKind::kText) {
      return reply;
    }
  }
  return std::nullopt;
}

std::size_t encode_text_reply(std::string_view payload, std::span<std::uint8_t> room) noexcept {
  ByteWriter writer(room);
  writer.text(payload);
  writer.hex(crc16(payload), kCrcDigits);
  writer.text("\r");
  return writer.overrun() ? 0 : writer.size();
}

}  // namespace tubed::aurora
