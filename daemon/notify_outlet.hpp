// What is published, as the service manager hears of it.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "daemon/publishing/systemd_notify.hpp"

namespace tubed {

/// The daemon's state in one line: every instrument's validity and why, then the stages that are not running.
/// `instruments`, `validities` and `reasons` have one element an instrument.
std::string status_words(const std::vector<std::string>& instruments, const std::vector<Validity>& validities,
                         const std::vector<Reasons>& reasons, std::span<const NamedReport> reports);

/// Hands everything on to the next outlet and tells the service manager after it: readiness and the watchdog
/// depend on estimates that have left the process. With several instruments, all have to leave. All calls
/// come from the publisher thread.
class NotifyOutlet final : public ForwardingOutlet {
 public:
  /// All three outlive this object.
  NotifyOutlet(const Configuration& configuration, SystemdNotify& notify, Outlet& next);

  void publish(const TubeEstimate& estimate) override;
  void publish_status(std::span<const NamedReport> reports) override;

 private:
  SystemdNotify& notify_;
  std::vector<std::string> instruments_;
  std::vector<Validity> validities_;
  std::vector<Reasons> reasons_;
  std::vector<bool> has_left_;  ///< since the watchdog was last told
};

}  // namespace tubed
