#include "daemon/config/changed_keys.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <map>
#include <sstream>

namespace tubed {

namespace {

using ValuesByName = std::map<std::string, std::string>;

// A list without tables is one value; a list of tables is as many.
bool is_value(const toml::node& node) { return !node.is_table() && !node.is_array_of_tables(); }

void flatten(const toml::node& node, const std::string& name, ValuesByName& values) {
  if (is_value(node)) {
    std::ostringstream text;
    node.visit([&](const auto& value) { text << value; });
    values[name] = text.str();
  } else if (const toml::array* const tables = node.as_array()) {
    for (std::size_t i = 0; i < tables->size(); ++i) {
      flatten(*tables->get(i), name + "[" + std::to_string(i + 1) + "]", values);
    }
  } else {
    for (const auto& [key, child] : *node.as_table()) {
      flatten(child, name.empty() ? std::string(key.str()) : name + "." + std::string(key.str()), values);
    }
  }
}

ValuesByName values_of(std::string_view text) {
  ValuesByName values;
  flatten(toml::parse(text), "", values);
  return values;
}

}  // namespace

std::vector<std::string> changed_keys(std::string_view before, std::string_view after) {
  const ValuesByName old_values = values_of(before);
  ValuesByName new_values = values_of(after);
  std::vector<std::string> changed;
  for (const auto& [name, value] : old_values) {
    const auto found = new_values.find(name);
    if (found == new_values.end() || found->second != value) {
      changed.push_back(name);
    }
    new_values.erase(name);
  }
  for (const auto& [name, value] : new_values) {
    changed.push_back(name);
  }
  std::sort(changed.begin(), changed.end());
  return changed;
}

}  // namespace tubed
