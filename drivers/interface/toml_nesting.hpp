// How deep tables of a TOML file may lie in each other, told before it is parsed. Pure.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>

namespace tubed {

/// Many times what any file of ours has outside its comments, decimal points included.
inline constexpr std::size_t kMaxTomlDots = 4096;

/// toml++ limits how deep values lie in each other, but not the tables that a dotted key makes (a.a.a = 1),
/// and it destroys tables by recursion: half a megabyte of dots would overflow the stack. No file has more
/// tables in each other than dots outside its comments. The number of the line, counted from 1, in which
/// there are too many; nothing when the text may be parsed.
inline std::optional<int> line_of_too_many_dots(std::string_view text) {
  std::size_t dots = 0;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t");
    // Also inside a text of several lines no key begins on a line that begins with #.
    if (first != std::string_view::npos && line[first] != '#') {
      dots += static_cast<std::size_t>(std::count(line.begin(), line.end(), '.'));
    }
    if (dots > kMaxTomlDots) {
      return number;
    }
  }
  return std::nullopt;
}

}  // namespace tubed
