// Estimates into shared memory beside DDS.
#pragma once

#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "daemon/pipeline/stage_thread.hpp"
#include "daemon/publishing/shm_publisher.hpp"
#include "daemon/shm_wake_stage.hpp"

namespace tubed {

/// Hands everything on to the next outlet, and each estimate to shared memory after it: whatever readers of
/// shared memory do, subscribers have theirs. All calls come from the publisher thread. It wakes the first
/// readers itself; the rest are woken by a thread of their own, "shm-wake", without a real-time priority.
class ShmOutlet final : public ForwardingOutlet {
 public:
  /// `next` outlives this object; `daemon_start` is what it publishes. Throws ShmError.
  ShmOutlet(const Configuration& configuration, std::uint64_t daemon_start, Outlet& next);

  bool publish(const TubeEstimate& estimate) override;
  /// With "shm-door" among the stages: readers that came, were let in, were refused, came too often.
  void publish_health(std::span<const NamedReport> reports) override;

 private:
  ShmPublisher publisher_;
  ShmDoorCounters logged_;
  StageReport door_;  ///< readers, as a stage's counters
  std::vector<NamedReport> reports_;
  ShmWakeStage wake_stage_;
  StageThread wake_thread_;  // last made, first ended
};

}  // namespace tubed
