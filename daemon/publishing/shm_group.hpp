// The group whose members may read shared memory.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace tubed {

/// Nothing for an empty name. Throws ShmError, naming the key, when this system has no such group.
std::optional<gid_t> group_of(const std::string& name);

}  // namespace tubed
