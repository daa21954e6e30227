// What can be set about the shared memory, and the keys of [shm].
#pragma once

#include <string>

#include "idl/settings/bound_key.hpp"

namespace tubed {

/// Where software on the same machine finds estimates and images.
struct ShmSettings {
  std::string estimates_socket;  ///< path; empty = no estimates in shared memory
  std::string group;             ///< members may read; empty = root and the daemon's user only
  std::string preview_folder{};  ///< where each camera's images are, preview-NAME.sock; empty = none
};

/// The keys of [shm]. Paths are relative to the file that names them.
inline BoundKeys<ShmSettings> shm_keys() {
  using S = ShmSettings;
  return {
      key::text("estimates_socket", &S::estimates_socket, {0, 107, true, ""},
                "path of the socket where readers get them, such as /run/tubed/estimates.sock; empty = none"),
      key::text("preview_folder", &S::preview_folder, {0, 60, true, ""},
                "folder where viewers find each camera's images, 15 a second, at the socket "
                "preview-NAME.sock, such as "
                "/run/tubed; empty = none"),
      key::text("group", &S::group, {0, 32, true, ""},
                "group whose members may read; empty = root and the daemon's user only")};
}

}  // namespace tubed
