// Values as they stand in a configuration file.
#pragma once

#include <string>

#include "clients/calibration/configuration_fragment.hpp"

namespace tubed {

/// "KEY = VALUE" without a line break at its end; the rows of a matrix stand below each other.
std::string key_line(const std::string& key, const SettingValue& value);

/// The value alone; the rows of a matrix, but for the first, are indented by `indent` spaces.
std::string value_text(const SettingValue& value, std::size_t indent);

/// What goes above a value: who found it and when, as a comment without a line break at its end.
std::string origin_comment(const ConfigurationFragment& fragment);

}  // namespace tubed
