// Where a value stands in a configuration, as FoundValue::path writes it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// A table on the way to a key; `element`: which one of a list of tables, by id, name or number from 1.
struct PathStep {
  std::string table;
  std::optional<std::string> element{};

  friend bool operator==(const PathStep&, const PathStep&) = default;
};

/// "camera[A].c_arm.zoom" is the tables {camera, A} and {c_arm}, and the key zoom.
struct ValuePath {
  std::vector<PathStep> tables;  ///< outermost first, at least one
  std::string key;
};

/// Throws FragmentError for a path without a table, with an empty name or with brackets that do not fit.
ValuePath parse_value_path(std::string_view path);

/// "[camera.c_arm]", "[[camera]]": the header of the innermost of the first `count` tables.
std::string header_of(const ValuePath& path, std::size_t count);

/// The key by which an element of that list is named: "id" of an instrument, "name" of a camera, empty of a
/// list whose elements are counted.
std::string naming_key_of(std::string_view table);

}  // namespace tubed
