// Text from outside as it may be shown and logged: a grabber's name, an instrument id, a device's reply.
// It may contain line breaks, terminal escapes or invalid UTF-8.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tubed {

/// What stands for each character that cannot be shown: U+FFFD, the replacement character.
inline constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

namespace printable_detail {

/// The bytes of one character, or of the beginning of one that breaks off.
struct Character {
  std::size_t length = 1;
  bool is_whole = false;
  std::uint32_t code_point = 0;
};

/// How a lead byte goes on: Unicode 15, Table 3-7 (no overlong forms, no surrogates, nothing above U+10FFFF).
struct Lead {
  std::size_t length = 0;  ///< of the character; 0: no lead byte
  unsigned char first_low = 0x80;
  unsigned char first_high = 0xBF;
};

constexpr Lead lead_of(unsigned char byte) noexcept {
  if (byte < 0x80) return {1};
  if (byte < 0xC2) return {};
  if (byte < 0xE0) return {2};
  if (byte == 0xE0) return {3, 0xA0, 0xBF};
  if (byte == 0xED) return {3, 0x80, 0x9F};
  if (byte < 0xF0) return {3};
  if (byte == 0xF0) return {4, 0x90, 0xBF};
  if (byte < 0xF4) return {4};
  if (byte == 0xF4) return {4, 0x80, 0x8F};
  return {};
}

/// The first character of `text`, which is not empty.
constexpr Character first_character(std::string_view text) noexcept {
  const auto byte_at = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const Lead lead = lead_of(byte_at(0));
  if (lead.length == 0) return {};
  if (lead.length == 1) return {1, true, byte_at(0)};
  std::uint32_t code_point = byte_at(0) & (0xFFU >> (lead.length + 1));
  for (std::size_t i = 1; i < lead.length; ++i) {
    const unsigned char low = i == 1 ? lead.first_low : 0x80;
    const unsigned char high = i == 1 ? lead.first_high : 0xBF;
    if (i >= text.size() || byte_at(i) < low || byte_at(i) > high) return {i, false, 0};
    code_point = code_point << 6U | (byte_at(i) & 0x3FU);
  }
  return {lead.length, true, code_point};
}

struct Range {
  std::uint32_t first;
  std::uint32_t last;
};

/// Characters that are not seen, or change how their neighbours are: controls, line and paragraph separators,
/// directional overrides, zero-width and tag characters, and what Unicode calls no character.
inline constexpr Range kNotShown[]{{0x0000, 0x001F}, {0x007F, 0x009F},  {0x00AD, 0x00AD}, {0x034F, 0x034F},
                                   {0x061C, 0x061C}, {0x115F, 0x1160},  {0x17B4, 0x17B5}, {0x180B, 0x180F},
                                   {0x200B, 0x200F}, {0x2028, 0x202E},  {0x2060, 0x206F}, {0x3164, 0x3164},
                                   {0xFDD0, 0xFDEF}, {0xFE00, 0xFE0F},  {0xFEFF, 0xFEFF}, {0xFFA0, 0xFFA0},
                                   {0xFFF0, 0xFFFB}, {0xE0000, 0xE0FFF}};

constexpr bool is_shown(std::uint32_t code_point) noexcept {
  const bool is_no_character = (code_point & 0xFFFEU) == 0xFFFEU;
  return !is_no_character &&
         std::none_of(std::begin(kNotShown), std::end(kNotShown), [&](const Range& range) {
           return code_point >= range.first && code_point <= range.last;
         });
}

}  // namespace printable_detail

/// Takes the first character off `text`, which must not be empty: the character as it is, or kReplacement for
/// one that cannot be shown and for bytes that are no UTF-8 (as many as belong together).
inline std::string_view take_printable(std::string_view& text) noexcept {
  const auto [length, is_whole, code_point] = printable_detail::first_character(text);
  const std::string_view character = text.substr(0, length);
  text.remove_prefix(length);
  return is_whole && printable_detail::is_shown(code_point) ? character : kReplacement;
}

/// Writes `text` into `destination` as it may be shown, cut between two characters where it does not fit, and
/// zeros behind it, at least one. Any bytes are taken; plain text stays as it is. Does not allocate. The two
/// must not overlap.
inline void copy_printable(std::string_view text, std::span<char> destination) noexcept {
  if (destination.empty()) return;
  std::size_t used = 0;
  while (!text.empty()) {
    const std::string_view piece = take_printable(text);
    if (piece.size() > destination.size() - 1 - used) break;
    std::copy(piece.begin(), piece.end(), destination.begin() + static_cast<std::ptrdiff_t>(used));
    used += piece.size();
  }
  std::fill(destination.begin() + static_cast<std::ptrdiff_t>(used), destination.end(), '\0');
}

/// The same as a string of at most `max_bytes`.
inline std::string printable_text(std::string_view text, std::size_t max_bytes = std::string::npos) {
  std::string shown;
  shown.reserve(std::min(text.size(), max_bytes));
  while (!text.empty()) {
    const std::string_view piece = take_printable(text);
    if (piece.size() > max_bytes - shown.size()) break;
    shown += piece;
  }
  return shown;
}

}  // namespace tubed
