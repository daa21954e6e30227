// The three check sums on an Aurora's wires: CRC-16/ARC of the serial protocol, CRC-8 SAE J1850 and CRC-32 of
// the CAN frames. Any thread; no state.
#pragma once

#include <cstdint>

#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora {

/// CRC-16/ARC: x^16 + x^15 + x^2 + 1, reflected, starts at 0. `start` goes on from an earlier part's result.
/// Over a block followed by its own CRC, low byte first, the result is 0.
[[nodiscard]] std::uint16_t crc16(Bytes bytes, std::uint16_t start = 0) noexcept;
[[nodiscard]] std::uint16_t crc16(std::string_view text, std::uint16_t start = 0) noexcept;

/// CRC-8 SAE J1850 (0x1D, starts at 0xFF, inverted) of a CAN frame: its identifier, low byte first (2 bytes;
/// 4 with kCanExtended, without that bit), then `bytes`.
[[nodiscard]] std::uint8_t can_crc8(std::uint32_t can_id, Bytes bytes) noexcept;

/// CRC-32 (as in Ethernet and zlib) of a CAN frame: its identifier, as for can_crc8(), then
/// `bytes`.
[[nodiscard]] std::uint32_t can_crc32(std::uint32_t can_id, Bytes bytes) noexcept;

}  // namespace tubed::aurora
