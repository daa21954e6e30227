// What the doctor says about an Aurora that was talked to.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "clients/tubectl/check/tracker_report.hpp"
#include "clients/tubectl/check/tracker_startup.hpp"

namespace tubed {

/// What was measured in a while.
struct TrackerMeasurements {
  EmFrame newest;
  int count = 0;
  std::chrono::nanoseconds time{};
};

enum class ReplyForm { kBinary, kText };

/// The adapter and its latency timer.
Finding adapter_finding(const AdapterFacts& adapter);

/// How many handles are allocated, enabled, and in the newest reply, and which are not enabled: one that is
/// allocated is in the tracker's replies all the same.
Finding handle_finding(const aurora::Session& session);

/// Whether replies are binary, and why not. Text is no reason for a slower line: it needs a faster one.
Finding reply_finding(ReplyForm form, const aurora::PollerCounts& counts, const TrackerStartup& startup);

/// All about a tracker that measures. `wanted_baud`: that of the configuration.
std::vector<NamedFinding> findings_of_tracking(const aurora::Session& session,
                                               const TrackerMeasurements& measured,
                                               const AdapterFacts& adapter, const std::string& wanted_baud);

}  // namespace tubed
