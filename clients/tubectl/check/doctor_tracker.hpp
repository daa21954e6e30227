// What the doctor says about the EM tracker that a configuration names.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "clients/tubectl/check/tracker_report.hpp"

namespace tubed {

/// What is known of the port of an Aurora without talking through it.
struct PortExamination {
  std::vector<NamedFinding> findings;  ///< the first says whether it can be opened
  AdapterFacts adapter;
};

/// Can the port of an Aurora, or the CAN bus of its gateway, be opened by this user, which process else has
/// it, and which adapter is it? It is closed again at once and nothing is said through it. Nothing for other
/// trackers.
PortExamination examine_port(const Configuration& configuration);

struct TrackerExamination {
  std::vector<NamedFinding> findings;
  std::string report;  ///< for the person who helps; empty when there is none
};

/// Behind a gateway: listens to what comes (doctor_can.hpp). At a serial port: starts the Aurora as the
/// daemon does and measures for a while: firmware, rate of the line, ports and coils, measurements a second,
/// errors. Takes as long as the tracker needs for the tools that are plugged in, half a minute for four, and
/// leaves the tracker stopped; calls `on_progress` with what is being done, each time that is something else.
/// What went over the line is written into `trace_folder` (aurora-serial-request.log) unless that is empty.
/// Nothing for other trackers.
TrackerExamination examine_tracker(const Configuration& configuration, const PortExamination& port,
                                   const std::filesystem::path& trace_folder,
                                   const std::function<void(const std::string&)>& on_progress);

}  // namespace tubed
