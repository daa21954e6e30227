// What is published while somebody else publishes the same instruments.
#pragma once

#include "daemon/config/configuration.hpp"
#include "daemon/forwarding_outlet.hpp"
#include "daemon/publishing/rival_watch.hpp"

namespace tubed {

/// Hands everything on to the next outlet. While an instrument has a rival its shapes and its status are
/// QUESTIONABLE at best, with the reason RIVAL_WRITER; that it came, who it is and that it went is logged.
/// All calls come from the publisher thread, which looks for rivals after each estimate has left.
class RivalOutlet final : public ForwardingOutlet {
 public:
  /// `configuration`, `participant` (the publisher's) and `next` outlive this object. Throws DdsError.
  RivalOutlet(const Configuration& configuration, const DdsEntity& participant, Outlet& next);

  bool publish(const TubeEstimate& estimate) override;
  void publish_status(const PipelineStatus& status) override;
  [[nodiscard]] bool is_status_due() const override {
    return is_status_due_ || ForwardingOutlet::is_status_due();
  }

 private:
  void log_changes() const;

  const Configuration& configuration_;
  RivalWatch watch_;
  TubeEstimate flagged_estimate_;
  std::vector<InstrumentStatus> flagged_statuses_;
  std::vector<bool> is_flagged_;  ///< the newest estimate of each instrument
  bool is_status_due_ = false;    ///< a flag was set or taken away since the last status
};

}  // namespace tubed
