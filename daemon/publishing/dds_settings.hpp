// What can be set about the DDS side.
#pragma once

#include <string>

namespace tubed {

struct DdsSettings {
  int domain = 0;                        ///< 0 .. 230
  std::string partition;                 ///< the room; empty = the default partition
  std::string network_interface = "lo";  ///< "lo" keeps everything on this host; a name or address opens it
  std::string world_frame = "world";     ///< what "world" is, for TubeIdentity
  std::string world_axes = "as registered";  ///< or "LPS", "RAS": what its axes are, for TubeIdentity
};

}  // namespace tubed
