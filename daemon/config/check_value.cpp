// One value of the file against one row of the schema.
#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "daemon/config/checked_table.hpp"
#include "idl/printable_text.hpp"
#include "idl/settings/near_miss.hpp"

namespace tubed {

namespace {

// Checks one value; nothing means that a problem was noted.
class ValueCheck {
 public:
  ValueCheck(const KeyDescription& key, std::string path, std::vector<ConfigurationProblem>& problems)
      : key_(key), path_(std::move(path)), problems_(problems) {}

  std::optional<SettingValue> value(const toml::node& node) {
    return std::visit([&](const auto& of_type) { return read(node, of_type); }, key_.default_value);
  }

 private:
  using Outcome = std::optional<SettingValue>;

  std::nullopt_t wrong(const toml::node& node, const std::string& message, const std::string& where = "") {
    problems_.push_back({position_of(node), path_ + where, message});
    return std::nullopt;
  }

  std::nullopt_t unexpected(const toml::node& node, const std::string& where = "") {
    return wrong(node, "expected " + expectation(key_) + ", found " + found_text(node), where);
  }

  [[nodiscard]] bool in_range(double number) const {
    return number >= key_.minimum && number <= key_.maximum;
  }

  std::optional<std::int64_t> integer(const toml::node& node, const std::string& where = "") {
    const auto number = node.value_exact<std::int64_t>();
    if (!number || !in_range(static_cast<double>(*number))) {
      return unexpected(node, where);
    }
    return *number;
  }

  std::optional<double> real(const toml::node& node, const std::string& where = "") {
    if (!node.is_number()) {
      return unexpected(node, where);
    }
    const double number = *node.value<double>();
    if (!std::isfinite(number)) {
      return wrong(node, "expected " + expectation(key_) + ", finite, found " + found_text(node), where);
    }
    if (!in_range(number)) {
      return unexpected(node, where);
    }
    return number;
  }

  Outcome read(const toml::node& node, bool) {
    const auto value = node.value_exact<bool>();
    return value ? Outcome(*value) : unexpected(node);
  }

  Outcome read(const toml::node& node, std::int64_t) {
    const auto number = integer(node);
    return number ? Outcome(*number) : std::nullopt;
  }

  Outcome read(const toml::node& node, double) {
    const auto number = real(node);
    return number ? Outcome(*number) : std::nullopt;
  }

  Outcome read(const toml::node& node, const std::string&) {
    const auto text = node.value_exact<std::string>();
    if (!text) {
      return unexpected(node);
    }
    if (!key_.choices.empty()) {
      return one_of_the_choices(node, *text);
    }
    const std::string why = refusal(*text);
    return why.empty() ? Outcome(*text) : wrong(node, why + ", found " + found_text(node));
  }

  Outcome one_of_the_choices(const toml::node& node, const std::string& word) {
    if (std::find(key_.choices.begin(), key_.choices.end(), word) != key_.choices.end()) {
      return word;
    }
    return wrong(node, "expected " + expectation(key_) + ", found " + found_text(node) +
                           suggestion(word, key_.choices));
  }

  // Why a free text cannot be taken; empty when it can.
  [[nodiscard]] std::string refusal(const std::string& text) const {
    const TextRule& rule = key_.text;
    if (text.size() < rule.minimum_bytes) {
      return "expected a text that is not empty";
    }
    if (text.size() > rule.maximum_bytes) {
      return "expected at most " + std::to_string(rule.maximum_bytes) + " bytes of text, got " +
             std::to_string(text.size());
    }
    if (printable_text(text) != text) {
      return "expected printable characters only";
    }
    if (rule.ascii_only &&
        std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) > 0x7E; })) {
      return "expected printable ASCII characters only";
    }
    const auto forbidden = text.find_first_of(rule.forbidden);
    return forbidden == std::string::npos ? ""
                                          : std::string("expected a text without '") + text[forbidden] + "'";
  }

  template <typename T, typename ReadItem>
  std::optional<std::vector<T>> list(const toml::node& node, ReadItem read_item) {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() < key_.minimum_count || array->size() > key_.maximum_count) {
      return unexpected(node);
    }
    std::vector<T> items;
    for (std::size_t i = 0; i < array->size(); ++i) {
      if (const auto item = read_item(*array->get(i), index_text(i))) {
        items.push_back(*item);
      }
    }
    if (items.size() != array->size()) {
      return std::nullopt;
    }
    return items;
  }

  Outcome read(const toml::node& node, const std::vector<std::int64_t>&) {
    const auto items = list<std::int64_t>(
        node, [this](const toml::node& item, const std::string& where) { return integer(item, where); });
    return items ? Outcome(*items) : std::nullopt;
  }

  Outcome read(const toml::node& node, const std::vector<double>&) {
    const auto items = list<double>(
        node, [this](const toml::node& item, const std::string& where) { return real(item, where); });
    return items ? Outcome(*items) : std::nullopt;
  }

  Outcome read(const toml::node& node, const Eigen::Matrix4d&) {
    const toml::array* rows = node.as_array();
    if (rows == nullptr || rows->size() != 4) {
      return unexpected(node);
    }
    Eigen::Matrix4d matrix;
    bool sound = true;
    for (std::size_t i = 0; i < 4; ++i) {
      sound = read_row(*rows->get(i), i, matrix) && sound;
    }
    return sound ? Outcome(matrix) : std::nullopt;
  }

  bool read_row(const toml::node& node, std::size_t i, Eigen::Matrix4d& matrix) {
    const std::string where = index_text(i);
    const toml::array* row = node.as_array();
    if (row == nullptr || row->size() != 4) {
      unexpected(node, where);
      return false;
    }
    bool sound = true;
    for (std::size_t j = 0; j < 4; ++j) {
      const auto number = real(*row->get(j), where + index_text(j));
      sound = number.has_value() && sound;
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = number.value_or(0);
    }
    return sound;
  }

  const KeyDescription& key_;
  std::string path_;
  std::vector<ConfigurationProblem>& problems_;
};

}  // namespace

CheckedValue check_value(const toml::node& node, const KeyDescription& key, const std::string& path,
                         std::vector<ConfigurationProblem>& problems) {
  const auto value = ValueCheck(key, path, problems).value(node);
  return {value.value_or(key.default_value), value ? ValueState::kGiven : ValueState::kFaulty,
          position_of(node)};
}

FilePosition position_of(const toml::node& node) {
  const toml::source_position begin = node.source().begin;
  return begin.line == 0 ? FilePosition{} : FilePosition{begin.line, begin.column};
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  const auto nearest = near_miss(word, candidates);
  return nearest ? "; did you mean " + *nearest + "?" : "";
}

std::string index_text(std::size_t index) {
  std::string text("[");
  text += std::to_string(index);
  text += ']';
  return text;
}

std::string printable(std::string_view text) {
  constexpr std::size_t kMaxBytes = 60;
  const std::string shown = printable_text(text);
  return shown.size() <= kMaxBytes ? shown : printable_text(text, kMaxBytes) + "...";
}

std::string found_text(const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) {
    return '"' + printable(*text) + '"';
  }
  if (node.is_table()) {
    return "a table";
  }
  if (const toml::array* array = node.as_array()) {
    return "a list of " + std::to_string(array->size());
  }
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

}  // namespace tubed
