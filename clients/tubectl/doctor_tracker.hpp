// What the doctor says about the EM tracker that a configuration names.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/tubectl/doctor_checks.hpp"
#include "daemon/config/configuration.hpp"

namespace tubed {

struct NamedFinding {
  std::string name;
  Finding finding;
};

/// Can the port of an Aurora, or the CAN bus of its gateway, be opened by whoever asks? It is closed again at
/// once and nothing is said through it. Nothing for other trackers.
std::vector<NamedFinding> examine_port(const Configuration& configuration);

/// Behind a gateway: listens to what comes (doctor_can.hpp). At a serial port: starts the Aurora as the
/// daemon does and measures for a while: firmware, rate of the line, ports and coils, measurements a second,
/// errors. Takes a quarter of a minute at most and leaves the tracker stopped. What went over the line is
/// written into `trace_folder` (aurora-serial-request.log) unless that is empty. Nothing for other trackers.
std::vector<NamedFinding> examine_tracker(const Configuration& configuration,
                                          const std::filesystem::path& trace_folder);

}  // namespace tubed
