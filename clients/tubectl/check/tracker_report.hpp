// The block of text that support for a tracker needs to see.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/tubectl/check/doctor_checks.hpp"
#include "daemon/config/configuration.hpp"
#include "drivers/aurora/session.hpp"
#include "drivers/aurora_serial/usb_adapter.hpp"

namespace tubed {

struct NamedFinding {
  std::string name;
  Finding finding;
};

/// What the port's adapter is.
struct AdapterFacts {
  bool is_there = false;    ///< the port's device; nothing else is known of one that is not
  std::string device_name;  ///< as "ttyUSB0"; empty when the kernel does not say
  std::optional<UsbIdentity> identity;
  std::optional<int> latency_timer_ms;
};

/// "0403:da74, serial number 1, latency timer 1 ms", or that the port is not there or no USB adapter.
std::string adapter_text(const AdapterFacts& adapter);

/// "handle 0A port 1 channel 0 serial number 3C4B0001 sensor 1" or why it is not tracked.
std::string handle_text(const aurora::FoundCoil& coil, const aurora::CoilMap& map);

/// Versions, kernel, adapter, firmware, handles, errors, and all `findings` that are not good; no name of the
/// host, of a user or of a folder. `session`: nullptr when nobody could talk to the tracker.
std::string report_for_help(const Configuration& configuration, const AdapterFacts& adapter,
                            const aurora::Session* session, const std::vector<NamedFinding>& findings);

}  // namespace tubed
