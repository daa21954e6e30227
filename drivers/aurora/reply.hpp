// One reply of an Aurora, whatever the command was. Any thread; no state, no allocation.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora {

enum class ReplyKind {
  kOkay,
  kError,    ///< may answer any command, BX too
  kWarning,  ///< carried out, but something is worth a look
  kReset,    ///< the tracker has started anew: 9600 baud, nothing initialised
  kText,     ///< anything else in characters: what it means depends on the command
  kBinary,   ///< body of a BX reply
};

/// A reply whose check sum was right. The payload looks into the bytes it was read from.
struct Reply {
  ReplyKind kind = ReplyKind::kText;
  std::uint8_t error_code = 0;  ///< of kError
  Bytes payload;  ///< characters without check sum and carriage return, or the body of a BX reply

  [[nodiscard]] std::string_view text() const noexcept { return as_text(payload); }
};

/// OKAY, or WARNING. False for nullptr: there was no reply.
[[nodiscard]] inline bool carried_out(const Reply* reply) noexcept {
  return reply != nullptr && (reply->kind == ReplyKind::kOkay || reply->kind == ReplyKind::kWarning);
}

/// Reads a reply in characters, `line` being without its carriage return: payload and the payload's CRC-16 as
/// four digits. Nothing when the check sum is wrong or the payload empty.
[[nodiscard]] std::optional<Reply> decode_text_reply(std::string_view line) noexcept;

/// The same, but only one of the fixed words at the very end of `line`, whatever stands before it: a word
/// that follows noise is still good.
[[nodiscard]] std::optional<Reply> decode_word_at_end(std::string_view line) noexcept;

/// Writes `payload`, its check sum and a carriage return. Returns the size; 0 when `room` is too small.
[[nodiscard]] std::size_t encode_text_reply(std::string_view payload, std::span<std::uint8_t> room) noexcept;

}  // namespace tubed::aurora
