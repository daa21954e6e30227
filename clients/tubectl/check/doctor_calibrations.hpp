// Does a configuration say how well its room is known?
#pragma once

#include <vector>

#include "clients/tubectl/check/tracker_report.hpp"
#include "daemon/config/configuration.hpp"

namespace tubed {

/// Of a registered room with cameras: a note where no calibration states how well the registration, or the
/// focal length of a camera, is known, and by how much sigma takes in that they may be wrong then
/// (RoomErrors). Of other rooms nothing.
std::vector<NamedFinding> examine_calibrations(const Configuration& configuration);

}  // namespace tubed
