// What can be set about the DDS side, and the keys of [dds].
#pragma once

#include <string>

#include "idl/settings/bound_key.hpp"

namespace tubed {

struct DdsSettings {
  int domain = 0;                        ///< 0 .. 230
  std::string partition;                 ///< the room; empty = the default partition
  std::string network_interface = "lo";  ///< "lo" keeps everything on this host; a name or address opens it
  std::string security{};                ///< folder of the daemon's keys; empty = no DDS Security
  std::string world_frame = "world";     ///< what "world" is, for TubeIdentity
  std::string world_axes = "as registered";  ///< or "LPS", "RAS": what its axes are, for TubeIdentity
};

/// The keys of [dds]. `security` is relative to the file that names it.
inline BoundKeys<DdsSettings> dds_keys() {
  using S = DdsSettings;
  return {key::number("domain", &S::domain, "", {0, 230}, "DDS domain"),
          key::text("partition", &S::partition, {0, 128, true, "*?[]"},
                    "the room, as DDS partition; empty = the default partition"),
          key::text("network_interface", &S::network_interface, {1, 64, true, " /<>&\"'"},
                    "name or address of the interface; lo = nothing leaves this host"),
          key::text(
              "security", &S::security, {0, 4096, true, ""},
              "folder of the daemon's keys, made by `tubectl keys make-room`; only programs with keys of the "
              "same room then read and publish; empty = DDS Security off"),
          key::text("world_frame", &S::world_frame, {1, 64, true, ""}, "what the world frame is, in words"),
          key::word("world_axes", &S::world_axes,
                    {{"as registered", "as registered"}, {"LPS", "LPS"}, {"RAS", "RAS"}},
                    "the patient's directions along x, y, z of the world frame: left, posterior, superior; "
                    "right, anterior, superior; or whatever the registration makes of them")};
}

}  // namespace tubed
