// Text of bounded length, put together where nothing may allocate.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "idl/printable_text.hpp"

namespace tubed {

/// Text of at most `Capacity` bytes; the characters that do not fit are left off, and whatever follows them.
template <std::size_t Capacity>
class BoundedText {
 public:
  BoundedText() = default;
  explicit BoundedText(std::string_view text) noexcept { *this << text; }

  BoundedText& operator<<(std::string_view text) noexcept {
    return append(text, [](std::string_view& rest) noexcept {
      const std::string_view character = rest.substr(0, printable_detail::first_character(rest).length);
      rest.remove_prefix(character.size());
      return character;
    });
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
  /// Text from outside, each character that cannot be shown replaced: see printable_text.hpp.
  BoundedText& printable(std::string_view text) noexcept { return append(text, take_printable); }

  [[nodiscard]] std::string_view text() const noexcept { return {characters_.data(), size_}; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  void clear() noexcept {
    size_ = 0;
    is_full_ = false;
  }

  friend bool operator==(const BoundedText& a, const BoundedText& b) noexcept { return a.text() == b.text(); }

 private:
  /// `take_character` takes the next one off a text.
  template <typename TakeCharacter>
  BoundedText& append(std::string_view text, TakeCharacter take_character) noexcept {
    while (!text.empty() && !is_full_) {
      const std::string_view character = take_character(text);
      is_full_ = character.size() > Capacity - size_;
      if (!is_full_) {
        std::copy(character.begin(), character.end(), characters_.begin() + size_);
        size_ += character.size();
      }
    }
    return *this;
  }

  std::array<char, Capacity> characters_{};
  std::size_t size_ = 0;
  bool is_full_ = false;  ///< something was left off
};

}  // namespace tubed
