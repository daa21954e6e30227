#include "drivers/aurora/checksums.hpp"

#include "drivers/aurora/can_identifiers.hpp"

namespace tubed::aurora {

namespace {

/// Table of a reflected CRC: what one byte does to the register.
template <typename Register>
constexpr std::array<Register, 256> reflected_table(Register polynomial) {
  std::array<Register, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    auto value = static_cast<Register>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      value = static_cast<Register>((value >> 1) ^ ((value & 1U) != 0 ? polynomial : Register{0}));
    }
    table[byte] = value;
  }
  return table;
}

constexpr std::array<std::uint8_t, 256> crc8_table() {
  std::array<std::uint8_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned value = byte;
    for (int bit = 0; bit < 8; ++bit) {
      value = (value << 1) ^ ((value & 0x80U) != 0 ? 0x11DU : 0U);
    }
    table[byte] = static_cast<std::uint8_t>(value);
  }
  return table;
}

constexpr auto kCrc16 = reflected_table<std::uint16_t>(0xA001);
constexpr auto kCrc32 = reflected_table<std::uint32_t>(0xEDB88320);
constexpr auto kCrc8 = crc8_table();

/// An identifier as check sums run over it: 2 bytes of one with 11 bits, 4 of one with 29, low byte first.
class IdBytes {
 public:
  explicit IdBytes(std::uint32_t can_id) noexcept : size_((can_id & kCanExtended) != 0 ? 4 : 2) {
    ByteWriter(bytes_).u32(can_id & ~kCanExtended);
  }
  [[nodiscard]] Bytes bytes() const noexcept { return Bytes(bytes_).first(size_); }

 private:
  std::array<std::uint8_t, 4> bytes_{};
  std::size_t size_;
};

std::uint8_t crc8_over(Bytes bytes, std::uint8_t value) noexcept {
  for (const std::uint8_t byte : bytes) {
    value = kCrc8[value ^ byte];
  }
  return value;
}

std::uint32_t crc32_over(Bytes bytes, std::uint32_t value) noexcept {
  for (const std::uint8_t byte : bytes) {
    value = kCrc32[(value ^ byte) & 0xFF] ^ (value >> 8);
  }
  return value;
}

}  // namespace

std::uint16_t crc16(Bytes bytes, std::uint16_t start) noexcept {
  unsigned value = start;
  for (const std::uint8_t byte : bytes) {
    value = kCrc16[(value ^ byte) & 0xFF] ^ (value >> 8);
  }
  return static_cast<std::uint16_t>(value);
}

std::uint16_t crc16(std::string_view text, std::uint16_t start) noexcept {
  return crc16(as_bytes(text), start);
}

std::uint8_t can_crc8(std::uint32_t can_id, Bytes bytes) noexcept {
  return static_cast<std::uint8_t>(~crc8_over(bytes, crc8_over(IdBytes(can_id).bytes(), 0xFF)));
}

std::uint32_t can_crc32(std::uint32_t can_id, Bytes bytes) noexcept {
  return ~crc32_over(bytes, crc32_over(IdBytes(can_id).bytes(), 0xFFFFFFFFU));
}

}  // namespace tubed::aurora
