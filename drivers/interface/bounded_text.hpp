// Text of bounded length, put together where nothing may allocate.
#pragma once

#include <array>
#include <charconv>
#include <string_view>

namespace tubed {

/// Text of at most `Capacity` characters; what does not fit is left off.
template <std::size_t Capacity>
class BoundedText {
 public:
  BoundedText() = default;
  explicit BoundedText(std::string_view text) noexcept { *this << text; }

  BoundedText& operator<<(std::string_view text) noexcept {
    for (const char c : text) {
      if (size_ < Capacity) {
        characters_[size_++] = c;
      }
    }
    return *this;
  }
  BoundedText& operator<<(int number) noexcept {
    std::array<char, 12> digits{};
    const auto end = std::to_chars(digits.begin(), digits.end(), number).ptr;
    return *this << std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data()));
  }
  /// The lower `digits` hexadecimal digits.
  BoundedText& hex(unsigned value, unsigned digits = 2) noexcept {
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    while (digits > 0) {
      *this << kDigits.substr(value >> 4U * --digits & 0xFU, 1);
    }
    return *this;
  }
  /// Text from a device: what is no printable ASCII becomes '?'.
  BoundedText& printable(std::string_view text) noexcept {
    for (const char c : text) {
      *this << (c >= ' ' && c <= '~' ? std::string_view(&c, 1) : std::string_view("?"));
    }
    return *this;
  }

  [[nodiscard]] std::string_view text() const noexcept { return {characters_.data(), size_}; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  void clear() noexcept { size_ = 0; }

  friend bool operator==(const BoundedText& a, const BoundedText& b) noexcept { return a.text() == b.text(); }

 private:
  std::array<char, Capacity> characters_{};
  std::size_t size_ = 0;
};

}  // namespace tubed
