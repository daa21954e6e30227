// One command as it was heard, without its CR: two equivalent forms (README.md, Line).
#pragma once

#include <string>
#include <string_view>

namespace tubed::second_aurora {

struct CommandLine {
  std::string name;        // upper case
  std::string parameters;  // without the CRC
  int error = 0;           // ERRORnn that answers the line without a look at the command; 0: none
};

inline constexpr std::size_t kLongestLine = 256;

// `NAME:parametersCCCC` with CRC or `NAME parameters` without. ERROR01 without separator, 02 above
// kLongestLine, 03 when empty, 04 when the CRC is wrong or missing.
CommandLine read_command(std::string_view line);

}  // namespace tubed::second_aurora
