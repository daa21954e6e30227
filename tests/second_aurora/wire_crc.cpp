#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0xA001u : crc >> 1;
    }
  }
  return static_cast<std::uint16_t>(crc);
}

std::uint16_t crc16(std::string_view text) {
  return crc16(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

std::string hex(std::uint64_t value, int digits) {
  std::string text(static_cast<std::size_t>(digits), '0');
  for (auto digit = text.rbegin(); digit != text.rend(); ++digit, value >>= 4) {
    *digit = "0123456789ABCDEF"[value & 0xF];
  }
  return text;
}

std::optional<std::uint32_t> from_hex(std::string_view text) {
  if (text.empty() || text.size() > 8) {
    return std::nullopt;
  }
  std::uint32_t value = 0;
  for (const char digit : text) {
    int of_digit = 0;
    if (digit >= '0' && digit <= '9') {
      of_digit = digit - '0';
    } else if (digit >= 'A' && digit <= 'F') {
      of_digit = digit - 'A' + 10;
    } else if (digit >= 'a' && digit <= 'f') {
      of_digit = digit - 'a' + 10;
    } else {
      return std::nullopt;
    }
    value = value << 4 | static_cast<std::uint32_t>(of_digit);
  }
  return value;
}

Bytes framed(std::string_view text) {
  Bytes bytes(text.begin(), text.end());
  for (const char digit : hex(crc16(text), 4)) {
    bytes.push_back(static_cast<std::uint8_t>(digit));
  }
  bytes.push_back('\r');
  return bytes;
}

}  // namespace tubed::second_aurora
