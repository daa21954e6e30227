#pragma once

#include <string>

namespace tubed {

/// Where software on the same machine finds the estimates.
struct ShmSettings {
  std::string estimates_socket;  ///< path; empty = no estimates in shared memory
  std::string group;             ///< members may read; empty = root and the daemon's user only
};

}  // namespace tubed
