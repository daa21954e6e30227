// What is published, as the service manager hears of it.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "daemon/publishing/start_back_off.hpp"
#include "daemon/publishing/systemd_notify.hpp"

namespace tubed {

/// Hands everything on to the next outlet and tells the service manager after it: readiness and the watchdog
/// depend on estimates that were written. With several instruments, all have to leave. All calls
/// come from the publisher thread.
class NotifyOutlet final : public ForwardingOutlet {
 public:
  /// All four outlive this object. `back_off`: of this start, which has succeeded when all have left once.
  NotifyOutlet(const Configuration& configuration, SystemdNotify& notify, const StartBackOff& back_off,
               Outlet& next);

  bool publish(const TubeEstimate& estimate) override;
  void publish_status(const PipelineStatus& status) override;

 private:
  SystemdNotify& notify_;
  const StartBackOff& back_off_;
  std::vector<std::string> instruments_;
  std::vector<bool> has_left_;  ///< since the watchdog was last told
  bool has_started_ = false;    ///< all have left once
};

}  // namespace tubed
