#include "drivers/aurora_serial/aurora_serial_driver.hpp"

#include "drivers/aurora_serial/aurora_serial_source.hpp"

namespace tubed {

std::vector<KeyDescription> aurora_serial_settings() {
  return {
      key::word("baud", "115200", {"9600", "14400", "19200", "38400", "57600", "115200", "230400", "921600"},
                "rate of the line while tracking; 5 coils need 115200, 8 coils 230400"),
      key::real("reply_margin_ms", 40.0, "ms", {5, 5000},
                "how long a reply may be late, beyond its time on the line"),
      key::real("latency_ms", 0.0, "ms", {0, 500}, "from a measurement to its readiness in the tracker"),
      key::text(
          "tool_folder", "", {},
          "folder with port-1.rom, port-2.rom, ... for tools without a programmed memory; empty = none"),
      key::text("trace_folder", "/var/log/tubed", {},
                "folder for logs of the line after a failure, or when aurora-serial-request is made there; "
                "empty, or not there = none"),
      key::integer("trace_kb", 512, "KiB", {16, 65536}, "how much of the line is kept in memory")};
}

DriverDescription aurora_serial_driver() {
  DriverDescription driver{"aurora-serial",
                           "an NDI Aurora at a serial port, em.device",
                           Origin::kDevice,
                           aurora_serial_settings(),
                           [](const SourceContext& context) {
                             return make_aurora_serial_em_source(
                                 context.room, context.settings_with_paths({"tool_folder", "trace_folder"}),
                                 context.device);
                           },
                           {}};
  driver.needs_device = true;
  driver.finds_coils_by_port = true;
  driver.gives_orientation = true;
  return driver;
}

std::unique_ptr<EmSource> make_aurora_serial_em_source(const RoomDescription& room,
                                                       const DriverSettings& settings,
                                                       const std::string& device) {
  return std::make_unique<AuroraSerialSource>(room, settings, device);
}

}  // namespace tubed
