#include "clients/tubectl/calibrate/bad_data.hpp"

#include <iostream>
#include <stdexcept>

#include "clients/tubectl/verbs.hpp"
#include "idl/dds_entity.hpp"

namespace tubed {

int saying_bad_data(const std::function<int()>& run) {
  try {
    return run();
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  } catch (const std::runtime_error& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  }
}

}  // namespace tubed
