#include "clients/tubectl/run/setting_options.hpp"

#include <algorithm>
#include <map>

namespace tubed {

namespace {

std::string option_name(std::string key) {
  std::replace(key.begin(), key.end(), '_', '-');
  return "--" + key;
}

}  // namespace

SettingOptions::SettingOptions(CommandLine& verb, const std::string& heading,
                               const std::vector<KeyDescription>& keys) {
  for (const KeyDescription& key : keys) {
    add(verb, heading, options_.emplace_back(Option{.key = key}));
  }
}

void SettingOptions::add(CommandLine& verb, const std::string& heading, Option& option) {
  const KeyDescription& key = option.key;
  const std::string name = option_name(key.name);
  if (const auto* flag = std::get_if<bool>(&key.default_value)) {
    option.flag = *flag;
    verb.add_flag(name, option.flag, key.meaning).group(heading);
  } else if (const auto* text = std::get_if<std::string>(&key.default_value)) {
    option.text = *text;
    Argument argument = verb.add_option(name, option.text, key.meaning);
    argument.capture_default_str().group(heading);
    if (!key.choices.empty()) argument.is_member(key.choices);
  } else if (const auto* real = std::get_if<double>(&key.default_value)) {
    option.real = *real;
    verb.add_option(name, option.real, key.meaning)
        .in_range(key.minimum, key.maximum)
        .capture_default_str()
        .group(heading);
  } else if (const auto* integer = std::get_if<std::int64_t>(&key.default_value)) {
    option.integer = *integer;
    verb.add_option(name, option.integer, key.meaning)
        .in_range(static_cast<std::int64_t>(key.minimum), static_cast<std::int64_t>(key.maximum))
        .capture_default_str()
        .group(heading);
  } else if (std::holds_alternative<std::vector<std::int64_t>>(key.default_value)) {
    verb.add_option(name, option.list, key.meaning)
        .in_range(static_cast<int>(key.minimum), static_cast<int>(key.maximum))
        .expected(1, static_cast<int>(key.maximum_count))
        .delimiter(',')
        .group(heading);
  }
}

SettingValue SettingOptions::value_of(const Option& option) {
  const SettingValue& usual = option.key.default_value;
  if (std::holds_alternative<bool>(usual)) return option.flag;
  if (std::holds_alternative<std::int64_t>(usual)) return option.integer;
  if (std::holds_alternative<double>(usual)) return option.real;
  if (std::holds_alternative<std::string>(usual)) return option.text;
  if (std::holds_alternative<std::vector<std::int64_t>>(usual)) {
    return std::vector<std::int64_t>(option.list.begin(), option.list.end());
  }
  return usual;
}

DriverSettings SettingOptions::settings() const {
  std::map<std::string, SettingValue> values;
  for (const Option& option : options_) {
    values.emplace(option.key.name, value_of(option));
  }
  return DriverSettings(std::move(values));
}

}  // namespace tubed
