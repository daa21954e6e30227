// The keys of a driver's table as options of a verb.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "drivers/interface/driver_settings.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {

/// rate_hz becomes --rate-hz, a list takes "1,2,3"; ranges, choices and defaults are those of the key.
/// Outlives the command line.
class SettingOptions {
 public:
  /// Adds an option for each key of yes and no, text, number or list of whole numbers; others keep their
  /// default.
  SettingOptions(CommandLine& verb, const std::string& heading, const std::vector<KeyDescription>& keys);

  /// Once the command line has been parsed.
  [[nodiscard]] DriverSettings settings() const;

 private:
  struct Option {
    KeyDescription key;
    bool flag = false;
    std::string text{};
    double real = 0;
    std::int64_t integer = 0;
    std::vector<int> list{};
  };
  static void add(CommandLine& verb, const std::string& heading, Option& option);
  static SettingValue value_of(const Option& option);

  std::deque<Option> options_;
};

}  // namespace tubed
