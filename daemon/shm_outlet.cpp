#include "daemon/shm_outlet.hpp"

#include <spdlog/spdlog.h>

#include "idl/estimate_age.hpp"

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
    : ForwardingOutlet(next),
      publisher_(configuration.shm, instrument_ids(configuration), daemon_start),
      wake_stage_(publisher_),
      wake_thread_("shm-wake", wake_stage_, ThreadSettings{}) {
  wake_thread_.start();  // default scheduling: nothing that could be refused
}

bool ShmOutlet::publish(const TubeEstimate& estimate) {
  const bool is_written = ForwardingOutlet::publish(estimate);
  const ClockPair now = read_clocks();  // as DdsOutlet
  if (!is_history(estimate, now.monotonic_ns) && publisher_.publish(estimate, now)) {
    wake_stage_.wake();
  }
  return is_written;
}

void ShmOutlet::publish_health(std::span<const NamedReport> reports) {
  // At most once a second: a flood of readers does not flood the log.
  const ShmDoorCounters& counters = publisher_.door_counters();
  if (counters.refused != logged_.refused || counters.throttled != logged_.throttled) {
    spdlog::warn("shared memory: {} readers admitted, {} refused, {} turned away because they came too often",
                 counters.admitted, counters.refused, counters.throttled);
    logged_ = counters;
  }
  door_.state = StageState::kRunning;
  door_.steps = counters.admitted + counters.refused + counters.throttled;
  door_.outputs = counters.admitted;
  door_.refused = counters.refused;
  door_.dropped = counters.throttled;
  reports_.assign(reports.begin(), reports.end());
  reports_.push_back({"shm-door", &door_});
  ForwardingOutlet::publish_health(reports_);
}

}  // namespace tubed
