#include "drivers/laboratory/aurora_emulator/device_settings.hpp"

namespace tubed::aurora::emulator {

std::vector<Plug> two_coils_a_port(int sensors) {
  std::vector<Plug> plugs;
  for (int sensor = 1; sensor <= sensors; sensor += 2) {
    Plug plug;
    plug.port = static_cast<int>(plugs.size()) + 1;
    plug.sensors = {sensor};
    if (sensor < sensors) {
      plug.sensors.push_back(sensor + 1);
    }
    plug.serial_number = 0x3C4B0000U + static_cast<std::uint32_t>(plug.port);
    plugs.push_back(plug);
  }
  return plugs;
}

}  // namespace tubed::aurora::emulator
