// What is published, as the service manager hears of it.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "daemon/publishing/systemd_notify.hpp"

namespace tubed {

/// Hands everything on to the next outlet and tells the service manager after it: readiness and the watchdog
/// depend on estimates that were written. With several instruments, all have to leave. All calls
/// come from the publisher thread.
class NotifyOutlet final : public ForwardingOutlet {
 public:
  /// All three outlive this object.
  NotifyOutlet(const Configuration& configuration, SystemdNotify& notify, Outlet& next);

  bool publish(const TubeEstimate& estimate) override;
  void publish_status(const PipelineStatus& status) override;

 private:
  SystemdNotify& notify_;
  std::vector<std::string> instruments_;
  std::vector<bool> has_left_;  ///< since the watchdog was last told
};

}  // namespace tubed
