#include "drivers/aurora_serial/aurora_serial_driver.hpp"

#include <limits>

#include "drivers/aurora_serial/aurora_serial_source.hpp"

namespace tubed {

std::vector<SettingDescription> aurora_serial_settings() {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return {
      {"baud",
       std::string("115200"),
       false,
       -kNoLimit,
       kNoLimit,
       {"9600", "14400", "19200", "38400", "57600", "115200", "230400", "921600"},
       "bit/s",
       "rate of the line while tracking; 5 coils need 115200, 8 coils 230400"},
      {"reply_margin_ms",
       40.0,
       false,
       5,
       5000,
       {},
       "ms",
       "how long a reply may be late, beyond its time on the line"},
      {"latency_ms", 0.0, false, 0, 500, {}, "ms", "from a measurement to its readiness in the tracker"},
      {"tool_folder",
       std::string(),
       false,
       -kNoLimit,
       kNoLimit,
       {},
       "",
       "folder with port-1.rom, port-2.rom, ... for tools without a programmed memory; empty = none"},
      {"trace_folder",
       std::string("/var/log/tubed"),
       false,
       -kNoLimit,
       kNoLimit,
       {},
       "",
       "folder for logs of the line after a failure, or when aurora-serial-request is made there; empty, or "
       "not there = none"},
      {"trace_kb", std::int64_t{512}, false, 16, 65536, {}, "KiB", "how much of the line is kept in memory"},
  };
}

std::unique_ptr<EmSource> make_aurora_serial_em_source(const RoomDescription& room,
                                                       const DriverSettings& settings,
                                                       const std::string& device) {
  return std::make_unique<AuroraSerialSource>(room, settings, device);
}

}  // namespace tubed
