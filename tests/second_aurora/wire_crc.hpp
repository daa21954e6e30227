// CRC-16/ARC and the hexadecimal numbers of the Aurora's protocol (README.md, Line).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tubed::second_aurora {

using Bytes = std::vector<std::uint8_t>;

std::uint16_t crc16(std::span<const std::uint8_t> bytes);
std::uint16_t crc16(std::string_view text);

// Upper case, zero-padded to `digits`; higher digits are cut off.
std::string hex(std::uint64_t value, int digits);
// Empty unless `text` consists of 1 to 8 hexadecimal digits.
std::optional<std::uint32_t> from_hex(std::string_view text);

// Text + CRC + CR, as every reply in text leaves the device.
Bytes framed(std::string_view text);

}  // namespace tubed::second_aurora
