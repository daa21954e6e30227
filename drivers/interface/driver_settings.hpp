// What a driver's table of the configuration says. The driver describes its keys (KeyDescription), so that
// the configuration can check them with file, line and column before the driver sees them. The keys of driver
// "x" stand in the table [x]; "device" of [em] or [[camera]] reaches the driver as it is.
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "idl/settings/key_description.hpp"

namespace tubed {

/// Checked values of one driver's table, defaults filled in.
class DriverSettings {
 public:
  DriverSettings() = default;
  explicit DriverSettings(std::map<std::string, SettingValue> values) : values_(std::move(values)) {}

  /// The value of a described key. A key or type that was not described is a bug: throws std::logic_error.
  template <typename T>
  [[nodiscard]] const T& get(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end() || !std::holds_alternative<T>(found->second)) {
      throw std::logic_error("driver setting '" + name + "' was not described with this type");
    }
    return std::get<T>(found->second);
  }

  /// The same settings with one value replaced or added.
  [[nodiscard]] DriverSettings with(const std::string& name, SettingValue value) const {
    DriverSettings changed = *this;
    changed.values_.insert_or_assign(name, std::move(value));
    return changed;
  }

 private:
  std::map<std::string, SettingValue> values_;
};

}  // namespace tubed
