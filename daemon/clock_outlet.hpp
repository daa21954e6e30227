// What is published while the host's real-time clock follows no reference.
#pragma once

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "idl/kernel_clock.hpp"

namespace tubed {

/// Hands everything on to the next outlet. Where subscribers may be on other hosts, that is with any
/// `[dds] network_interface` but lo, estimates and status carry CLOCK_UNSYNCED unless the kernel says that
/// CLOCK_REALTIME follows a reference; the shape is as good as before, so that the validity stays. Changes
/// are logged. All calls come from the publisher thread; the kernel is asked once a second.
class ClockOutlet final : public ForwardingOutlet {
 public:
  /// `next` outlives this object.
  ClockOutlet(const Configuration& configuration, Outlet& next)
      : ForwardingOutlet(next), has_other_hosts_(configuration.dds.network_interface != "lo") {}

  bool publish(const TubeEstimate& estimate) override;
  void publish_status(const PipelineStatus& status) override;
  [[nodiscard]] bool is_status_due() const override {
    return is_status_due_ || ForwardingOutlet::is_status_due();
  }

 private:
  void look();
  [[nodiscard]] bool is_flagged() const {
    return has_other_hosts_ && reference_ != ClockReference::kFollowed;
  }

  bool has_other_hosts_;
  ClockReference reference_ = ClockReference::kFollowed;
  std::int64_t next_look_ns_ = 0;
  bool is_status_due_ = false;  ///< the reason came or went since the last status
  TubeEstimate flagged_estimate_;
  std::vector<InstrumentStatus> flagged_statuses_;
};

}  // namespace tubed
