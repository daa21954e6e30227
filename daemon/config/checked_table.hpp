// A table of the file after it was held against the schema: typed values with their places.
#pragma once

#include <toml++/impl/forward_declarations.h>

#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/configuration_error.hpp"
#include "daemon/config/schema.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

/// How a value came about. Only kDefault and kGiven may be trusted.
enum class ValueState {
  kDefault,  ///< not in the file
  kGiven,    ///< in the file, and sound
  kAbsent,   ///< not in the file and without default
  kFaulty,   ///< in the file, or missing although required; a problem was noted
};

struct CheckedValue {
  SettingValue value;  ///< the default when absent or faulty
  ValueState state = ValueState::kDefault;
  FilePosition position;  ///< of the value; of the table when it is not in the file
};

/// Always complete: every key and table of its description is there. A key or table that is not described is
/// a bug and throws std::out_of_range, a wrong type std::bad_variant_access.
class CheckedTable {
 public:
  std::string path;       ///< "camera[1]"
  FilePosition position;  ///< of its header
  bool given = false;     ///< stands in the file
  std::map<std::string, CheckedValue> values;
  std::map<std::string, std::vector<CheckedTable>> tables;

  [[nodiscard]] const CheckedValue& at(const std::string& key) const { return values.at(key); }
  template <typename T>
  [[nodiscard]] const T& get(const std::string& key) const {
    return std::get<T>(values.at(key).value);
  }
  /// Is the value in the file, and sound?
  [[nodiscard]] bool has(const std::string& key) const { return at(key).state == ValueState::kGiven; }
  /// May conclusions be drawn from the value?
  [[nodiscard]] bool sound(const std::string& key) const {
    return at(key).state == ValueState::kGiven || at(key).state == ValueState::kDefault;
  }
  [[nodiscard]] const CheckedTable& one(const std::string& table) const { return tables.at(table).at(0); }
  [[nodiscard]] const std::vector<CheckedTable>& many(const std::string& table) const {
    return tables.at(table);
  }
  /// The dotted path of a key of this table.
  [[nodiscard]] std::string path_of(const std::string& key) const {
    return path.empty() ? key : path + "." + key;
  }
};

/// Sets the members that the keys of this table are bound to. A key that is left out and has no default
/// leaves its member alone, and so does an optional one that is faulty.
template <typename Settings>
void read_keys(const CheckedTable& table, const BoundKeys<Settings>& keys, Settings& settings) {
  for (const BoundKey<Settings>& bound : keys) {
    const CheckedValue& value = table.at(bound.key.name);
    const bool is_unknown = value.state == ValueState::kAbsent ||
                            (value.state == ValueState::kFaulty && bound.key.presence == Presence::kOptional);
    if (bound.set && !is_unknown) {
      bound.set(settings, value.value);
    }
  }
}

/// Holds a parsed file against `schema` and adds what is wrong to `problems`.
CheckedTable check_file(const toml::table& file, const TableDescription& schema,
                        std::vector<ConfigurationProblem>& problems);

/// One value: `path` names it in problems.
CheckedValue check_value(const toml::node& node, const KeyDescription& key, const std::string& path,
                         std::vector<ConfigurationProblem>& problems);

FilePosition position_of(const toml::node& node);

/// "; did you mean NAME?", or nothing.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// What stands in the file, short enough for a message and safe on a terminal: 31.5, "lo", a table.
std::string found_text(const toml::node& node);

/// "[3]", as it follows the name of a list.
std::string index_text(std::size_t index);

/// At most 60 bytes of `text` as it may be shown (printable_text.hpp); "..." behind what was cut.
std::string printable(std::string_view text);

}  // namespace tubed
