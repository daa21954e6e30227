#include "daemon/shm_outlet.hpp"

#include <spdlog/spdlog.h>

namespace tubed {

namespace {

std::vector<std::string> instrument_ids(const Configuration& configuration) {
  std::vector<std::string> ids;
  for (const InstrumentDescription& instrument : configuration.room.instruments) {
    ids.push_back(instrument.id);
  }
  return ids;
}

}  // namespace

ShmOutlet::ShmOutlet(const Configuration& configuration, std::uint64_t daemon_start, Outlet& next)
    : ForwardingOutlet(next), publisher_(configuration.shm, instrument_ids(configuration), daemon_start) {}

bool ShmOutlet::publish(const TubeEstimate& estimate) {
  publisher_.publish(estimate);  // first: it takes microseconds, a write to DDS a hundred
  return ForwardingOutlet::publish(estimate);
}

void ShmOutlet::publish_health(std::span<const NamedReport> reports) {
  // At most once a second: a flood of readers does not flood the log.
  const ShmDoorCounters& counters = publisher_.door_counters();
  if (counters.refused != logged_.refused || counters.throttled != logged_.throttled) {
    spdlog::warn("shared memory: {} readers admitted, {} refused, {} turned away because they came too often",
                 counters.admitted, counters.refused, counters.throttled);
    logged_ = counters;
  }
  ForwardingOutlet::publish_health(reports);
}

}  // namespace tubed
