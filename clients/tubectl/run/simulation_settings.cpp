#include "clients/tubectl/run/simulation_settings.hpp"

namespace tubed {

const DriverSettings* simulation_in(const Configuration& configuration) {
  if (configuration.em_source.driver == "simulation") {
    return &configuration.em_source.settings;
  }
  for (const SourceChoice& source : configuration.image_sources) {
    if (source.driver == "simulation") {
      return &source.settings;
    }
  }
  return nullptr;
}

}  // namespace tubed
