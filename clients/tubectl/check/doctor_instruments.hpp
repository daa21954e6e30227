// Where the coils of an instrument leave it unheld, and where one more would help.
#pragma once

#include <vector>

#include "clients/tubectl/check/tracker_report.hpp"
#include "daemon/config/configuration.hpp"

namespace tubed {

/// Of each configured instrument: stretches farther along the tube from every coil than
/// CoilObservations::kHolds_mm, which only images hold; a configured hook that no coil lies in, or whose mode
/// knows of straight tips alone. Advice where that concerns the tip and the images of the room, one view or
/// none, cannot make up for it, else a note.
std::vector<NamedFinding> examine_instruments(const Configuration& configuration);

}  // namespace tubed
