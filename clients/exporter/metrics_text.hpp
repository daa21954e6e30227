// What a daemon reports as Prometheus text, exposition format 0.0.4. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "TubeHealth.h"
#include "TubeStatus.h"

namespace tubed {

/// The newest reports of one instrument, and when they came, ns of any clock.
struct InstrumentReports {
  tubed_TubeStatus status{};
  tubed_TubeHealth health{};
  std::int64_t status_received_ns = 0;  ///< 0 = never
  std::int64_t health_received_ns = 0;  ///< 0 = never
};

/// All instruments by their id. `now_ns`: of the same clock. An instrument that has been silent for more than
/// 1.5 s is there with tubed_up 0 and nothing else: no figure of a dead daemon looks alive. Histograms leave
/// out the buckets of 96 that would not tell more than a factor of two.
std::string metrics_text(const std::map<std::string, InstrumentReports>& instruments, std::int64_t now_ns);

}  // namespace tubed
