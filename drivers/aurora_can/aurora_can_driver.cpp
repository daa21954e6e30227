#include "drivers/aurora_can/aurora_can_driver.hpp"

#include "drivers/aurora_can/aurora_can_source.hpp"
#include "drivers/aurora_can/can_local_bus.hpp"

namespace tubed {

std::vector<SettingDescription> aurora_can_settings() {
  return {
      {"latency_ms",
       25.0,
       false,
       0,
       250,
       {},
       "ms",
       "least time from a measurement to its SYNC on the bus; used only when the gateway does not say when "
       "it "
       "sent"},
      {"receive_buffer_kb",
       std::int64_t{256},
       false,
       4,
       8192,
       {},
       "KiB",
       "how much the kernel keeps while nobody reads; frames beyond that are lost and counted"},
  };
}

std::unique_ptr<EmSource> make_aurora_can_em_source(const RoomDescription& room,
                                                    const DriverSettings& settings,
                                                    const std::string& device) {
  const int buffer = static_cast<int>(settings.get<std::int64_t>("receive_buffer_kb")) * 1024;
  return std::make_unique<AuroraCanSource>(room, settings, make_can_port(device, CanUse::kReceive, buffer));
}

}  // namespace tubed
