// Words of findings.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace tubed {

/// As std::snprintf() has it, cut off after 319 characters.
inline std::string text_of(const char* format, auto... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace tubed
