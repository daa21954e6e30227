// An outlet in front of another one.
#pragma once

#include "daemon/pipeline/publisher_stage.hpp"

namespace tubed {

/// Hands everything on to the next outlet; what derives from it adds its own. All calls come from the
/// publisher thread.
class ForwardingOutlet : public Outlet {
 public:
  /// `next` outlives this object.
  explicit ForwardingOutlet(Outlet& next) : next_(next) {}

  bool publish(const TubeEstimate& estimate) override { return next_.publish(estimate); }
  void publish_em(const EmFrame& frame) override { next_.publish_em(frame); }
  void publish_tracker(const TrackerIdentity& tracker) override { next_.publish_tracker(tracker); }
  void publish_status(const PipelineStatus& status) override { next_.publish_status(status); }
  void publish_health(std::span<const NamedReport> reports) override { next_.publish_health(reports); }
  [[nodiscard]] bool is_status_due() const override { return next_.is_status_due(); }
  void log_stage(const NamedReport& report) override { next_.log_stage(report); }
  void log_validity(std::uint32_t instrument, const InstrumentStatus& status) override {
    next_.log_validity(instrument, status);
  }

 private:
  Outlet& next_;
};

}  // namespace tubed
