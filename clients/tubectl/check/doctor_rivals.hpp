// Does somebody else publish the instruments of this configuration?
#pragma once

#include <vector>

#include "clients/tubectl/check/doctor_tracker.hpp"
#include "daemon/config/configuration.hpp"

namespace tubed {

/// Listens for a second where the configuration's daemon publishes. One finding an instrument that somebody
/// publishes: by one writer, or by two, and who the other one is as far as DDS tells. Nothing when nobody
/// does.
std::vector<NamedFinding> examine_rivals(const Configuration& configuration);

}  // namespace tubed
