// Sentences put together where nothing may allocate.
#pragma once

#include <array>
#include <charconv>
#include <string_view>

namespace tubed::aurora {

/// Text of at most `Capacity` characters; what does not fit is left off.
template <std::size_t Capacity>
class Words {
 public:
  Words() = default;
  explicit Words(std::string_view text) noexcept { *this << text; }

  Words& operator<<(std::string_view text) noexcept {
    for (const char c : text) {
      if (size_ < Capacity) {
        characters_[size_++] = c;
      }
    }
    return *this;
  }
  Words& operator<<(int number) noexcept {
    std::array<char, 12> digits{};
    const auto end = std::to_chars(digits.begin(), digits.end(), number).ptr;
    return *this << std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data()));
  }
  /// Two hexadecimal digits.
  Words& hex(unsigned value) noexcept {
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    return *this << kDigits.substr(value >> 4U & 0xFU, 1) << kDigits.substr(value & 0xFU, 1);
  }

  [[nodiscard]] std::string_view text() const noexcept { return {characters_.data(), size_}; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  void clear() noexcept { size_ = 0; }

  friend bool operator==(const Words& a, const Words& b) noexcept { return a.text() == b.text(); }

 private:
  std::array<char, Capacity> characters_{};
  std::size_t size_ = 0;
};

/// What a person is told about a session.
using Problem = Words<240>;

}  // namespace tubed::aurora
