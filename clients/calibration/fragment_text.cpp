#include "clients/calibration/fragment_text.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <sstream>

#include "clients/calibration/value_path.hpp"

namespace tubed {

namespace {

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

// What comes from outside (names of markers, of files) must not end a comment.
std::string one_line(std::string text) {
  for (char& c : text) {
    c = static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? ' ' : c;
  }
  return text;
}

// The key that names an element of a list, or a comment that says which one it is.
std::string element_lines(const PathStep& step) {
  const std::string key = naming_key_of(step.table);
  return key.empty() ? "# the one with number " + one_line(*step.element) + "\n"
                     : key + " = " + quoted(*step.element) + "\n";
}

std::string headers_between(const ValuePath& path, std::vector<PathStep>& open) {
  std::string text;
  bool is_new = open.size() > path.tables.size();
  for (std::size_t i = 0; i < path.tables.size(); ++i) {
    is_new = is_new || i >= open.size() || !(open[i] == path.tables[i]);
    const bool is_written = path.tables[i].element || i + 1 == path.tables.size();
    if (is_new && is_written) {
      text += "\n" + header_of(path, i + 1) + "\n";
      text += path.tables[i].element ? element_lines(path.tables[i]) : "";
    }
  }
  open = path.tables;
  return text;
}

/// A table and where it leads, as FoundValue::path has it without the key.
using Tables = std::vector<std::pair<std::string, ValuePath>>;

/// Where a further table has to stand: before what is inside of it, and beside others of its outermost one,
/// so that no element of a list is opened twice.
Tables::const_iterator place_among(const Tables& tables, const std::string& table, const ValuePath& path) {
  const auto inside = std::find_if(tables.begin(), tables.end(),
                                   [&](const auto& other) { return other.first.starts_with(table + "."); });
  if (inside != tables.end()) {
    return inside;
  }
  const auto beside = std::find_if(tables.rbegin(), tables.rend(), [&](const auto& other) {
    return other.second.tables.front() == path.tables.front();
  });
  return beside == tables.rend() ? tables.end() : beside.base();
}

}  // namespace

std::string value_text(const SettingValue& value, std::size_t indent) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    return quoted(*text);
  }
  std::string text = to_toml(value);
  if (std::holds_alternative<Eigen::Matrix4d>(value)) {
    const std::string between = "],\n" + std::string(indent + 1, ' ') + "[";
    for (std::size_t at = text.find("], ["); at != std::string::npos;
         at = text.find("], [", at + between.size())) {
      text.replace(at, 4, between);
    }
  }
  return text;
}

std::string key_line(const std::string& key, const SettingValue& value) {
  return key + " = " + value_text(value, key.size() + 3);
}

std::string origin_comment(const ConfigurationFragment& fragment) {
  return "# found on " + one_line(fragment.date) + " by " + one_line(fragment.found_by);
}

std::string to_toml(const ConfigurationFragment& fragment) {
  std::string text = origin_comment(fragment) + "\n";
  for (const std::string& remark : fragment.remarks) {
    text += "# " + one_line(remark) + "\n";
  }
  // A table is written once: its values stand together, in the order in which tables were first named.
  Tables tables;
  std::map<std::string, std::string> lines;
  for (const FoundValue& found : fragment.values) {
    const ValuePath path = parse_value_path(found.path);
    const std::string table = found.path.substr(0, found.path.size() - path.key.size() - 1);
    if (lines.find(table) == lines.end()) {
      tables.insert(place_among(tables, table, path), {table, path});
    }
    lines[table] += key_line(path.key, found.value) + "\n";
  }
  std::vector<PathStep> open;
  for (const auto& [table, path] : tables) {
    text += headers_between(path, open) + lines.at(table);
  }
  return text;
}

std::string date_of_today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::string text(32, '\0');
  text.resize(std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M", &local));
  return text;
}

}  // namespace tubed
