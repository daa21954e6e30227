#include "drivers/aurora_can/aurora_can_driver.hpp"

#include <array>
#include <cstdio>
#include <stdexcept>

#include "drivers/aurora_can/aurora_can_source.hpp"
#include "drivers/aurora_can/can_local_bus.hpp"

namespace tubed {

std::vector<KeyDescription> aurora_can_settings() {
  return {
      key::real("latency_ms", 25.0, "ms", {0, 250},
                "least time from a measurement to its SYNC on the bus; used only when the gateway does not "
                "say when it sent"),
      key::integer("receive_buffer_kb", 256, "KiB", {4, 8192},
                   "how much the kernel keeps while nobody reads; frames beyond that are lost and counted"),
      key::integer("base_id", aurora::CanBase::kDefault, "", {0, 0x1FFF'FF80},
                   "first of the gateway's 128 identifiers, 768 = 0x300: a multiple of 0x80, the same as "
                   "--base-id of the gateway; on a bus shared with CANopen 0x680"),
      key::boolean("extended_ids", false, "the identifiers have 29 bits, as with --extended of the gateway")};
}

DriverDescription aurora_can_driver() {
  DriverDescription driver{"aurora-can",
                           "an NDI Aurora behind a gateway on a CAN bus, em.device",
                           Origin::kDevice,
                           aurora_can_settings(),
                           [](const SourceContext& context) {
                             return make_aurora_can_em_source(context.room, context.settings, context.device);
                           },
                           {}};
  driver.needs_device = true;
  return driver;
}

aurora::CanBase can_base_of(const DriverSettings& settings) {
  const std::int64_t number = settings.get<std::int64_t>("base_id");
  const bool is_extended = settings.get<bool>("extended_ids");
  const auto base = aurora::can_base(
      number, is_extended ? aurora::CanIdentifierSize::kExtended : aurora::CanIdentifierSize::kStandard);
  if (!base) {
    std::array<char, 24> hex{};
    std::snprintf(hex.data(), hex.size(), "0x%llX", static_cast<unsigned long long>(number));
    throw std::invalid_argument("aurora-can.base_id = " + std::string(hex.data()) + ": " +
                                std::string(aurora::kWhatCanBasesAre) + " (extended_ids = true)");
  }
  return *base;
}

std::unique_ptr<EmSource> make_aurora_can_em_source(const RoomDescription& room,
                                                    const DriverSettings& settings,
                                                    const std::string& device) {
  const int buffer = static_cast<int>(settings.get<std::int64_t>("receive_buffer_kb")) * 1024;
  return std::make_unique<AuroraCanSource>(
      room, settings, make_can_port(device, CanUse::kReceive, buffer, can_base_of(settings)));
}

}  // namespace tubed
