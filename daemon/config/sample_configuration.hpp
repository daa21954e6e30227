// The sample file, written from the schema so that it can never miss a key.
#pragma once

#include <string>
#include <vector>

#include "drivers/driver_registry/driver_registry.hpp"

namespace tubed {

/// A configuration that runs without hardware: simulated tracker and one view, one instrument with five
/// coils, the geometry of the paper's Sec. 3.1. Every key with meaning, what it takes, unit and default; keys
/// without a default that may be left out stand as comments.
std::string sample_configuration(const std::vector<DriverDescription>& available = drivers());

}  // namespace tubed
