// TOML file to Configuration: the only way to one.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/config/configuration_error.hpp"
#include "drivers/driver_registry/driver_registry.hpp"

namespace tubed {

/// Reads and checks `file`. Throws ConfigurationError with everything that was found wrong: a file that
/// cannot be read, a TOML syntax error (then only that), unknown keys, tables and words, wrong types, values
/// out of range, missing keys, combinations that cannot work, users, groups and folders of sockets that this
/// machine does not have. `available` says which drivers, and so which
/// driver tables and keys, exist.
Configuration load_configuration(const std::filesystem::path& file,
                                 const std::vector<DriverDescription>& available = drivers());

/// The same from text and without a look at this machine; `file` only names it in messages and tells what
/// relative paths are relative to.
Configuration parse_configuration(std::string_view text, const std::filesystem::path& file,
                                  const std::vector<DriverDescription>& available = drivers());

/// The sources a configuration asks for, not opened yet. `camera`: index in room.cameras. `configuration` has
/// to outlive them.
std::unique_ptr<EmSource> make_em_source(const Configuration& configuration,
                                         const std::vector<DriverDescription>& available = drivers());
std::unique_ptr<ImageSource> make_image_source(const Configuration& configuration, int camera,
                                               const std::vector<DriverDescription>& available = drivers());

}  // namespace tubed
