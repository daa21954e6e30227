// Numbers in sentences.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace tubed {

/// As printf has it, at most 255 bytes. Of numbers and short words.
template <typename... Values>
std::string formatted(const char* pattern, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

}  // namespace tubed
