// What is published while the keys of DDS Security come to their end.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "idl/key_folder.hpp"

namespace tubed {

/// Hands everything on to the next outlet and adds to each status a stage "keys": running, degraded from
/// kKeysEndSoonDays before the daemon's keys expire, failed afterwards, with the words. Cyclone 0.10 removes
/// the participant in the second in which its certificate or permissions expire, without an error from any
/// write: nobody hears the daemon over DDS any more, and only this outlet says why. Changes, and each day of
/// the last ones, are a line of the log. All calls come from the publisher thread.
class KeysOutlet final : public ForwardingOutlet {
 public:
  /// `configuration` and `next` outlive this object. With dds.security empty it adds nothing.
  KeysOutlet(const Configuration& configuration, Outlet& next);

  void publish_status(const PipelineStatus& status) override;

 private:
  void judge(std::int64_t now_s);

  std::string folder_;
  KeyHolder holder_;
  StageReport report_;
  std::int64_t told_days_ = 0;  ///< days left when the log was last told
  std::vector<NamedReport> stages_;
};

}  // namespace tubed
