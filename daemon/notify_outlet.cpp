#include "daemon/notify_outlet.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/status_words.hpp"

namespace tubed {

NotifyOutlet::NotifyOutlet(const Configuration& configuration, SystemdNotify& notify,
                           const StartBackOff& back_off, Outlet& next)
    : ForwardingOutlet(next), notify_(notify), back_off_(back_off) {
  for (const InstrumentDescription& instrument : configuration.room.instruments) {
    instruments_.push_back(instrument.id);
  }
  has_left_.resize(instruments_.size(), false);
}

bool NotifyOutlet::publish(const TubeEstimate& estimate) {
  if (!ForwardingOutlet::publish(estimate)) {
    return false;
  }
  has_left_[estimate.instrument] = true;
  if (std::find(has_left_.begin(), has_left_.end(), false) == has_left_.end()) {
    has_left_.assign(has_left_.size(), false);
    notify_.estimate_published(std::chrono::steady_clock::now());
    if (!std::exchange(has_started_, true)) {
      back_off_.succeed();
    }
  }
  return true;
}

void NotifyOutlet::publish_status(const PipelineStatus& status) {
  ForwardingOutlet::publish_status(status);
  notify_.status(status_words(instruments_, status));
}

}  // namespace tubed
