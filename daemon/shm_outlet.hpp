// Estimates into shared memory beside DDS.
#pragma once

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "daemon/publishing/shm_publisher.hpp"

namespace tubed {

/// Hands everything on to the next outlet, and each estimate to shared memory before it. All calls come from
/// the publisher thread.
class ShmOutlet final : public ForwardingOutlet {
 public:
  /// `next` outlives this object; `daemon_start` is what it publishes. Throws ShmError.
  ShmOutlet(const Configuration& configuration, std::uint64_t daemon_start, Outlet& next);

  bool publish(const TubeEstimate& estimate) override;
  void publish_health(std::span<const NamedReport> reports) override;

 private:
  ShmPublisher publisher_;
  ShmDoorCounters logged_;
};

}  // namespace tubed
