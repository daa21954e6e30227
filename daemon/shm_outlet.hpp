// Estimates into shared memory beside DDS.
#pragma once

#include "daemon/config/configuration.hpp"
#include "daemon/pipeline/publisher_stage.hpp"
#include "daemon/publishing/shm_publisher.hpp"

namespace tubed {

/// Hands everything on to the next outlet, and each estimate to shared memory before it. All calls come from
/// the publisher thread.
class ShmOutlet final : public Outlet {
 public:
  /// `next` outlives this object; `daemon_start` is what it publishes. Throws ShmError.
  ShmOutlet(const Configuration& configuration, std::uint64_t daemon_start, Outlet& next);

  void publish(const TubeEstimate& estimate) override;
  void publish_em(const EmFrame& frame) override { next_.publish_em(frame); }
  void publish_status(std::span<const NamedReport> reports, bool changed) override;
  void publish_health(std::span<const NamedReport> reports) override { next_.publish_health(reports); }

 private:
  Outlet& next_;
  ShmPublisher publisher_;
  ShmDoorCounters logged_;
};

}  // namespace tubed
