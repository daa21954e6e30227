// The drivers this build has. CMake finds them: see "Add a driver" in drivers/README.md.
#pragma once

#include <string_view>
#include <vector>

#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// All drivers of this build; made once, at the first call.
const std::vector<DriverDescription>& drivers();

/// The driver of that name in `available`, nullptr when there is none.
const DriverDescription* find_driver(const std::vector<DriverDescription>& available, std::string_view name);

}  // namespace tubed
