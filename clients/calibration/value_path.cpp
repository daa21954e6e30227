#include "clients/calibration/value_path.hpp"

#include "clients/calibration/configuration_fragment.hpp"

namespace tubed {

namespace {

[[noreturn]] void refuse(std::string_view path) {
  throw FragmentError("'" + std::string(path) +
                      "' is no place in a configuration: expected table.key, or list[NAME].key");
}

// An element's name may have dots: a dot inside of brackets separates nothing.
std::vector<std::string_view> parts_of(std::string_view path) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  bool is_inside = false;
  for (std::size_t i = 0; i <= path.size(); ++i) {
    if (i == path.size() || (path[i] == '.' && !is_inside)) {
      parts.push_back(path.substr(begin, i - begin));
      begin = i + 1;
    } else if (path[i] == '[' || path[i] == ']') {
      is_inside = path[i] == '[';
    }
  }
  return parts;
}

PathStep step_of(std::string_view part, std::string_view path) {
  const std::size_t bracket = part.find('[');
  if (bracket == std::string_view::npos) {
    return {std::string(part)};
  }
  if (bracket == 0 || part.back() != ']' || part.size() < bracket + 3) {
    refuse(path);
  }
  return {std::string(part.substr(0, bracket)),
          std::string(part.substr(bracket + 1, part.size() - bracket - 2))};
}

}  // namespace

ValuePath parse_value_path(std::string_view path) {
  const std::vector<std::string_view> parts = parts_of(path);
  ValuePath parsed;
  for (const std::string_view part : parts) {
    if (part.empty()) {
      refuse(path);
    }
  }
  if (parts.size() < 2 || parts.back().find_first_of("[]") != std::string_view::npos) {
    refuse(path);
  }
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    parsed.tables.push_back(step_of(parts[i], path));
  }
  parsed.key = parts.back();
  return parsed;
}

std::string header_of(const ValuePath& path, std::size_t count) {
  std::string dotted;
  for (std::size_t i = 0; i < count; ++i) {
    dotted += (i > 0 ? "." : "") + path.tables[i].table;
  }
  return path.tables[count - 1].element ? "[[" + dotted + "]]" : "[" + dotted + "]";
}

std::string naming_key_of(std::string_view table) {
  if (table == "instrument") {
    return "id";
  }
  return table == "camera" ? "name" : "";
}

}  // namespace tubed
