// Bytes and characters taken one after the other, and put one after the other, never past the end. All
// numbers on an Aurora's wires are little endian. No allocation, no exception; an object belongs to one
// thread.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>

namespace tubed::aurora {

using Bytes = std::span<const std::uint8_t>;

inline Bytes as_bytes(std::string_view text) noexcept {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}
inline std::string_view as_text(Bytes bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Takes little-endian numbers. Past the end it gives zeros and overrun() turns true and stays so.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) noexcept : bytes_(bytes) {}

  std::uint8_t u8() noexcept { return static_cast<std::uint8_t>(unsigned_of(1)); }
  std::uint16_t u16() noexcept { return static_cast<std::uint16_t>(unsigned_of(2)); }
  std::uint32_t u32() noexcept { return unsigned_of(4); }
  std::int16_t i16() noexcept { return static_cast<std::int16_t>(u16()); }
  std::int32_t i32() noexcept { return static_cast<std::int32_t>(u32()); }
  /// 24 bit, with sign.
  std::int32_t i24() noexcept { return static_cast<std::int32_t>(unsigned_of(3) << 8) >> 8; }
  float f32() noexcept { return std::bit_cast<float>(u32()); }

  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - next_; }
  [[nodiscard]] bool overrun() const noexcept { return overrun_; }

 private:
  std::uint32_t unsigned_of(std::size_t size) noexcept {
    if (left() < size) {
      next_ = bytes_.size();
      overrun_ = true;
      return 0;
    }
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value |= static_cast<std::uint32_t>(bytes_[next_ + i]) << (8 * i);
    }
    next_ += size;
    return value;
  }

  Bytes bytes_;
  std::size_t next_ = 0;
  bool overrun_ = false;
};

/// Puts little-endian numbers and text. What does not fit is dropped and overrun() turns true and stays so.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> room) noexcept : room_(room) {}

  void u8(std::uint8_t value) noexcept { put(value, 1); }
  void u16(std::uint16_t value) noexcept { put(value, 2); }
  void u32(std::uint32_t value) noexcept { put(value, 4); }
  void i16(std::int32_t value) noexcept { put(static_cast<std::uint32_t>(value), 2); }
  void i24(std::int32_t value) noexcept { put(static_cast<std::uint32_t>(value), 3); }
  void i32(std::int32_t value) noexcept { put(static_cast<std::uint32_t>(value), 4); }
  void f32(double value) noexcept { u32(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  void text(std::string_view text) noexcept {
    for (const char c : text) {
      u8(static_cast<std::uint8_t>(c));
    }
  }
  /// `digits` upper-case hexadecimal digits.
  void hex(std::uint32_t value, int digits) noexcept {
    for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
      u8(static_cast<std::uint8_t>("0123456789ABCDEF"[(value >> shift) & 0xF]));
    }
  }
  /// A sign, then `digits` decimal digits.
  void decimal(std::int64_t value, int digits) noexcept;

  [[nodiscard]] Bytes written() const noexcept { return room_.first(next_); }
  [[nodiscard]] std::size_t size() const noexcept { return next_; }
  [[nodiscard]] bool overrun() const noexcept { return overrun_; }

 private:
  void put(std::uint32_t value, std::size_t size) noexcept {
    if (room_.size() - next_ < size) {
      overrun_ = true;
      return;
    }
    for (std::size_t i = 0; i < size; ++i) {
      room_[next_++] = static_cast<std::uint8_t>(value >> (8 * i));
    }
  }

  std::span<std::uint8_t> room_;
  std::size_t next_ = 0;
  bool overrun_ = false;
};

/// Value of `text` if it is nothing but 1 to 8 hexadecimal digits of either case.
[[nodiscard]] std::optional<std::uint32_t> parse_hex(std::string_view text) noexcept;

/// Takes fixed-width fields from text. A field that is not there or not as asked leaves broken() true for
/// good.
class TextReader {
 public:
  explicit TextReader(std::string_view text) noexcept : text_(text) {}

  /// The next `size` characters.
  std::string_view take(std::size_t size) noexcept;
  /// `digits` hexadecimal digits.
  std::uint32_t hex(std::size_t digits) noexcept;
  /// A sign and `digits` decimal digits.
  std::int32_t decimal(std::size_t digits) noexcept;
  /// Takes `word` if it comes next.
  bool skip(std::string_view word) noexcept;

  [[nodiscard]] std::size_t left() const noexcept { return text_.size(); }
  [[nodiscard]] bool broken() const noexcept { return broken_; }

 private:
  std::string_view text_;
  bool broken_ = false;
};

}  // namespace tubed::aurora
