// Bytes written as hexadecimal digits, as they stand in a recording.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora {

inline std::vector<std::uint8_t> bytes_of(std::string_view hex) {
  std::vector<std::uint8_t> bytes;
  std::string digits;
  for (const char c : hex) {
    if (c == ' ') {
      continue;
    }
    digits += c;
    if (digits.size() == 2) {
      bytes.push_back(static_cast<std::uint8_t>(parse_hex(digits).value()));
      digits.clear();
    }
  }
  return bytes;
}

inline std::string text_of(Bytes bytes) { return std::string(as_text(bytes)); }

}  // namespace tubed::aurora
