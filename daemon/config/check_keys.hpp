// The keys for DDS Security that a configuration names: looked at when a daemon is to start or a file is
// checked, not when somebody only reads the configuration, who may not be allowed to see them.
#pragma once

#include <cstdint>

#include "daemon/config/configuration.hpp"

namespace tubed {

/// Throws ConfigurationError with everything that is wrong at `now_s` (seconds since 1970, UTC) with the
/// files in dds.security: missing, unreadable, readable by others, expired, not valid yet, of two identities
/// or rooms, or without the right to publish tubed's topics in dds.partition. Nothing when it is empty.
void check_keys(const Configuration& configuration, std::int64_t now_s);

}  // namespace tubed
