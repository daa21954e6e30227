// Which simulated world a configuration speaks of.
#pragma once

#include "daemon/config/configuration.hpp"

namespace tubed {

/// Settings of the first source with driver "simulation": the tracker's if it is one, else the first such
/// camera's. All of one file are the same table. nullptr when nothing is simulated.
[[nodiscard]] const DriverSettings* simulation_in(const Configuration& configuration);

}  // namespace tubed
