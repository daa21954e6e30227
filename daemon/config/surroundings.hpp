// What a sound file names and this machine does not have.
#pragma once

#include <filesystem>
#include <vector>

#include "daemon/config/assemble.hpp"

namespace tubed {

/// Adds: shm.group and drivers' users that the system does not know; sockets whose path is too long for one,
/// or whose folder is missing or cannot be written by the user of this process. Only what is used is looked
/// at. `folder`: what relative paths are relative to. Reads the user database and the file system, changes
/// nothing.
void check_surroundings(const CheckedTable& file, const std::filesystem::path& folder,
                        const std::vector<DriverDescription>& available, Problems& problems);

}  // namespace tubed
