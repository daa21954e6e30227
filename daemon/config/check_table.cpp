// The file against the schema: which tables and keys there are, and which there should be.
#include <toml++/toml.h>
#include <algorithm>
#include <utility>

#include "daemon/config/checked_table.hpp"

namespace tubed {

namespace {

std::string bracketed(const TableDescription& table, const std::string& dotted) {
  return table.shape == TableShape::kMany ? "[[" + dotted + "]]" : "[" + dotted + "]";
}

std::string joined(const std::string& path, const std::string& name) {
  return path.empty() ? name : path + "." + name;
}

class FileCheck {
 public:
  FileCheck(const TableDescription& schema, std::vector<ConfigurationProblem>& problems)
      : schema_(schema), problems_(problems) {}

  CheckedTable table(const toml::table& node, const TableDescription& description, const std::string& path) {
    CheckedTable checked{
        .path = path, .position = position_of(node), .given = true, .values = {}, .tables = {}};
    report_unknown(node, description, path);
    for (const KeyDescription& key : description.keys) {
      checked.values.emplace(key.name, value(node, key, checked, description));
    }
    for (const TableDescription& inner : description.tables) {
      checked.tables.emplace(inner.name, inner_tables(node.get(inner.name), inner, checked));
    }
    return checked;
  }

 private:
  void add(FilePosition position, const std::string& key, const std::string& message) {
    problems_.push_back({position, key, message});
  }

  CheckedValue value(const toml::table& node, const KeyDescription& key, const CheckedTable& table,
                     const TableDescription& description) {
    const bool is_replaced = !key.replaced_by.empty() && node.contains(key.replaced_by);
    if (const toml::node* found = node.get(key.name)) {
      if (is_replaced) {
        add(position_of(*found), table.path_of(key.name),
            "means nothing beside " + table.path_of(key.replaced_by) + ": expected one of the two");
      }
      return check_value(*found, key, table.path_of(key.name), problems_);
    }
    if (key.presence == Presence::kDefault) {
      return {key.default_value, ValueState::kDefault, table.position};
    }
    if (key.presence == Presence::kOptional || description.only_when_used || is_replaced) {
      return {key.default_value, ValueState::kAbsent, table.position};
    }
    add(table.position, table.path_of(key.name), "missing, expected " + expectation(key));
    return {key.default_value, ValueState::kFaulty, table.position};
  }

  std::vector<CheckedTable> inner_tables(const toml::node* node, const TableDescription& inner,
                                         const CheckedTable& outer) {
    return inner.shape == TableShape::kOne ? one(node, inner, outer) : many(node, inner, outer);
  }

  std::vector<CheckedTable> one(const toml::node* node, const TableDescription& inner,
                                const CheckedTable& outer) {
    const std::string path = outer.path_of(inner.name);
    if (node != nullptr && node->is_table()) {
      return {table(*node->as_table(), inner, path)};
    }
    if (node != nullptr) {
      add(position_of(*node), path,
          "expected the table [" + header_path(path) + "], found " + found_text(*node));
    } else if (inner.minimum_count > 0) {
      add(outer.position, path, "missing, the table [" + header_path(path) + "] is required");
    }
    return {left_out(inner, path, outer.position)};
  }

  std::vector<CheckedTable> many(const toml::node* node, const TableDescription& inner,
                                 const CheckedTable& outer) {
    const std::string path = outer.path_of(inner.name);
    const std::string header = "[[" + header_path(path) + "]]";
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    if (node != nullptr && array == nullptr) {
      add(position_of(*node), path,
          "expected " + header + ", found " +
              (node->is_table() ? "[" + header_path(path) + "]" : found_text(*node)));
      return {};
    }
    const std::size_t count = array == nullptr ? 0 : array->size();
    if (count < inner.minimum_count) {
      add(outer.position, path,
          "missing, at least " + std::to_string(inner.minimum_count) + " " + header + " is required");
    }
    std::vector<CheckedTable> checked;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string item_path = path + index_text(i);
      const toml::node& item = *array->get(i);
      if (i == inner.maximum_count) {
        add(position_of(item), item_path,
            "expected at most " + std::to_string(inner.maximum_count) + " " + header + ", found " +
                std::to_string(count));
        break;
      }
      if (!item.is_table()) {
        add(position_of(item), item_path, "expected " + header + ", found " + found_text(item));
        continue;
      }
      checked.push_back(table(*item.as_table(), inner, item_path));
    }
    return checked;
  }

  // What a table that is not in the file comes to: defaults, and no complaint about what it would require.
  CheckedTable left_out(const TableDescription& description, const std::string& path, FilePosition position) {
    CheckedTable checked{.path = path, .position = position, .given = false, .values = {}, .tables = {}};
    for (const KeyDescription& key : description.keys) {
      const ValueState state =
          key.presence == Presence::kDefault ? ValueState::kDefault : ValueState::kAbsent;
      checked.values.emplace(key.name, CheckedValue{key.default_value, state, position});
    }
    for (const TableDescription& inner : description.tables) {
      std::vector<CheckedTable> tables;
      if (inner.shape == TableShape::kOne) {
        tables.push_back(left_out(inner, checked.path_of(inner.name), position));
      }
      checked.tables.emplace(inner.name, std::move(tables));
    }
    return checked;
  }

  void report_unknown(const toml::table& node, const TableDescription& description, const std::string& path) {
    std::vector<std::string> known;
    for (const KeyDescription& key : description.keys) {
      known.push_back(key.name);
    }
    for (const TableDescription& inner : description.tables) {
      known.push_back(inner.name);
    }
    for (const auto& [key, value] : node) {
      if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
        report_unknown_word(key, value, known, path);
      }
    }
  }

  void report_unknown_word(const toml::key& key, const toml::node& value,
                           const std::vector<std::string>& known, const std::string& path) {
    const std::string name(key.str());
    const bool is_table = value.is_table() || value.is_array_of_tables();
    std::string advice = suggestion(name, known);
    if (advice.empty() && !is_table) {
      const std::string home = home_of(name, schema_, "");
      advice = home.empty() ? "" : "; it belongs in " + home;
    }
    const toml::source_position begin = is_table ? value.source().begin : key.source().begin;
    add({begin.line, begin.column}, printable(joined(path, name)),
        std::string(is_table ? "unknown table" : "unknown key") + advice);
  }

  // Which table has a key of that name; empty when none has.
  static std::string home_of(const std::string& name, const TableDescription& table,
                             const std::string& dotted) {
    for (const KeyDescription& key : table.keys) {
      if (key.name == name) {
        return bracketed(table, dotted);
      }
    }
    for (const TableDescription& inner : table.tables) {
      const std::string home = home_of(name, inner, joined(dotted, inner.name));
      if (!home.empty()) {
        return home;
      }
    }
    return "";
  }

  const TableDescription& schema_;
  std::vector<ConfigurationProblem>& problems_;
};

}  // namespace

CheckedTable check_file(const toml::table& file, const TableDescription& schema,
                        std::vector<ConfigurationProblem>& problems) {
  return FileCheck(schema, problems).table(file, schema, "");
}

}  // namespace tubed
