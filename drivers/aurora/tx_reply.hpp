// TX: tracking data as text. Any thread; no state, no allocation.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

/// Reads the payload of a TX reply (check sum and carriage return already taken off) into `reply`. False, and
/// `reply` is not to be used, unless every character is accounted for. A line feed after the last handle or
/// at the very end may be there or not; so may port status and frame of a disabled or unoccupied handle.
[[nodiscard]] bool decode_tx(std::string_view payload, TrackingReply& reply) noexcept;

/// Writes the payload of a TX reply: positions to 0.01 mm, rotations and indicators to 0.0001. Returns its
/// size; 0 when `room` is too small (73 bytes a handle and 8 are enough) or a number does not fit its field.
[[nodiscard]] std::size_t encode_tx(const TrackingReply& reply, std::span<std::uint8_t> room) noexcept;

}  // namespace tubed::aurora
