#include <algorithm>

#include "drivers/driver_registry/driver_registry.hpp"

namespace tubed {

const DriverDescription* find_driver(const std::vector<DriverDescription>& available, std::string_view name) {
  const auto found = std::find_if(available.begin(), available.end(),
                                  [&](const DriverDescription& driver) { return driver.name == name; });
  return found == available.end() ? nullptr : &*found;
}

}  // namespace tubed
