// BX: tracking data in binary. Any thread; no state, no allocation.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/aurora/bytes.hpp"
#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

inline constexpr std::uint8_t kBxStartLow = 0xC4;  ///< first byte on the wire
inline constexpr std::uint8_t kBxStartHigh = 0xA5;
inline constexpr std::size_t kBxHeaderSize = 6;  ///< start word, length of the body, CRC of these four bytes
inline constexpr std::size_t kBxCrcSize = 2;     ///< behind the body
/// Longest body: a count, kMaxHandles handles with a pose, a system status.
inline constexpr std::size_t kMaxBxBody = 1 + static_cast<std::size_t>(kMaxHandles) * 42 + 2;
inline constexpr std::size_t kMaxBxFrame = kBxHeaderSize + kMaxBxBody + kBxCrcSize;

/// How a look at bytes that begin with the start word ended.
enum class BxFrame {
  kComplete,   ///< header and body are there, both check sums are right and the handles fill the body
  kNeedsMore,  ///< so far nothing is wrong
  kBadStart,   ///< the start word is another
  kBadHeader,  ///< the header's check sum is wrong, or its length is more than any reply has
  kBadBody,    ///< the body's check sum is wrong, or its handles do not fill it
};

/// Looks at a frame from its start word on; of a complete one `body` is set.
[[nodiscard]] BxFrame frame_bx(Bytes bytes, Bytes& body) noexcept;

/// Reads the body of a BX reply into `reply`. False, and `reply` is not to be used, unless every byte is
/// accounted for. A handle's status other than valid, missing and disabled is none.
[[nodiscard]] bool decode_bx(Bytes body, TrackingReply& reply) noexcept;

/// Writes a whole BX reply with its two check sums. Unoccupied handles become disabled ones, implausible ones
/// missing. Returns its size; 0 when `room` is too small (kMaxBxFrame always is enough).
[[nodiscard]] std::size_t encode_bx(const TrackingReply& reply, std::span<std::uint8_t> room) noexcept;

}  // namespace tubed::aurora
