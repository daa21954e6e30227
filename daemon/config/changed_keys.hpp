// What differs between two configuration files, key by key.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// Dotted names of the keys whose values differ, appear or vanish, sorted: "estimator.mode", "camera[1].fx".
/// Comments, order and blanks do not count. Both texts have been parsed before: throws toml::parse_error
/// otherwise.
std::vector<std::string> changed_keys(std::string_view before, std::string_view after);

}  // namespace tubed
