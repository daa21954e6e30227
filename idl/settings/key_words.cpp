// How keys and values read in messages and in a file.
#include <array>
#include <charconv>
#include <cmath>

#include "idl/settings/key_description.hpp"

namespace tubed {

namespace {

// The shortest decimal that reads back as the same number.
std::string shortest(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end.ptr};
}

std::string plain_number(double value) {
  return value == std::floor(value) && std::abs(value) < 1e6 ? std::to_string(static_cast<long>(value))
                                                             : shortest(value);
}

std::string real_text(double value) {
  const std::string text = shortest(value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

template <typename T, typename Print>
std::string list_text(const std::vector<T>& list, Print print) {
  std::string text = "[";
  for (const T& item : list) {
    text += (text.size() > 1 ? ", " : "") + print(item);
  }
  return text + "]";
}

struct ToToml {
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return real_text(value); }
  std::string operator()(const std::string& value) const { return '"' + value + '"'; }
  std::string operator()(const std::vector<std::int64_t>& list) const {
    return list_text(list, [](std::int64_t item) { return std::to_string(item); });
  }
  std::string operator()(const std::vector<double>& list) const { return list_text(list, real_text); }
  std::string operator()(const Eigen::Matrix4d& matrix) const {
    std::vector<std::vector<double>> rows;
    for (int row = 0; row < 4; ++row) {
      rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
    }
    return list_text(rows, [this](const std::vector<double>& row) { return (*this)(row); });
  }
};

std::string range_text(const KeyDescription& key) {
  const std::string unit = key.unit.empty() ? "" : " " + key.unit;
  const bool has_minimum = std::isfinite(key.minimum);
  const bool has_maximum = std::isfinite(key.maximum);
  if (has_minimum && has_maximum) {
    return " from " + plain_number(key.minimum) + " to " + plain_number(key.maximum) + unit;
  }
  if (has_minimum) {
    return " of at least " + plain_number(key.minimum) + unit;
  }
  if (has_maximum) {
    return " of at most " + plain_number(key.maximum) + unit;
  }
  return unit.empty() ? "" : " in" + unit;
}

std::string count_text(const KeyDescription& key) {
  if (key.minimum_count == key.maximum_count) {
    return std::to_string(key.minimum_count) + " ";
  }
  if (key.minimum_count > 0) {
    return std::to_string(key.minimum_count) + " to " + std::to_string(key.maximum_count) + " ";
  }
  return "";
}

struct Expectation {
  const KeyDescription& key;
  std::string operator()(bool) const { return "true or false"; }
  std::string operator()(std::int64_t) const { return "an integer" + range_text(key); }
  std::string operator()(double) const { return "a real number" + range_text(key); }
  std::string operator()(const std::string&) const {
    return key.choices.empty() ? "a text in quotation marks"
                               : alternatives(key.choices) + ", in quotation marks";
  }
  std::string operator()(const std::vector<std::int64_t>&) const {
    return "a list of " + count_text(key) + "integers" + ", each" + range_text(key);
  }
  std::string operator()(const std::vector<double>&) const {
    return "a list of " + count_text(key) + "real numbers, each" + range_text(key);
  }
  std::string operator()(const Eigen::Matrix4d&) const {
    return "four rows of four real numbers, [[r, r, r, t], [r, r, r, t], [r, r, r, t], [0, 0, 0, 1]], t in "
           "mm";
  }
};

}  // namespace

std::string to_toml(const SettingValue& value) { return std::visit(ToToml{}, value); }

std::string alternatives(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
  }
  return text;
}

std::string expectation(const KeyDescription& key) { return std::visit(Expectation{key}, key.default_value); }

}  // namespace tubed
