#include "drivers/driver_registry/driver_registry.hpp"

#include "drivers/replay/replay_driver.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

const std::vector<DriverDescription>& drivers() {
  static const std::vector<DriverDescription> all = {
      {"replay", "a sequence folder played back in real time", Origin::kReplayed, replay_settings(),
       [](const SourceContext& context) { return make_replay_em_source(context.room, context.settings); },
       [](const SourceContext& context, int camera) {
         return make_replay_image_source(context.room, context.settings, camera);
       }},
      {"simulation", "a catheter in an aortic arch, without any hardware", Origin::kSimulated,
       simulation_settings(),
       [](const SourceContext& context) { return make_simulation_em_source(context.room, context.settings); },
       [](const SourceContext& context, int camera) {
         return make_simulation_image_source(context.room, context.settings, camera);
       }},
  };
  return all;
}

}  // namespace tubed
