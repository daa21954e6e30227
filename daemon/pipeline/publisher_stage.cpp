#include "daemon/pipeline/publisher_stage.hpp"

namespace tubed {

namespace {
// An estimate begun before a stall is history, also when it was finished afterwards: the process may have
// been stopped in the middle of it. The next one is at most a period away.
constexpr std::chrono::milliseconds kOldEstimate{150};
}  // namespace

bool PublisherStage::step(const Clock& clock) noexcept {
  const MonotonicTime now = clock.now();
  const bool any_estimate = publish_estimates(now);
  const bool any_em = publish_em();
  publish_reports(now);
  return any_estimate || any_em;
}

bool PublisherStage::publish_estimates(MonotonicTime now) {
  bool any = false;
  for (std::size_t i = 0; i < estimates_.size(); ++i) {
    if (!estimates_[i]->fetch()) {
      continue;
    }
    const TubeEstimate& estimate = estimates_[i]->front();
    if (to_ns(now) - estimate.stamps.optimizer_started_ns > std::chrono::nanoseconds(kOldEstimate).count()) {
      ++too_old_;
      continue;
    }
    outlet_.publish(estimate);
    ++outputs_;
    any = true;
    const Words words{estimate.validity, estimate.reasons};
    words_changed_ = words_changed_ || !(words == newest_words_[i]);
    newest_words_[i] = words;
  }
  return any;
}

bool PublisherStage::publish_em() {
  bool any = false;
  while (em_.pop(em_frame_)) {
    outlet_.publish_em(em_frame_);
    any = true;
  }
  return any;
}

void PublisherStage::publish_reports(MonotonicTime now) {
  reports_.clear();
  gather_(reports_);
  newest_states_.resize(reports_.size(), StageState::kStarting);
  bool changed = words_changed_ || outlet_.is_status_due();
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    changed = changed || reports_[i].report->state != newest_states_[i];
    newest_states_[i] = reports_[i].report->state;
  }
  const bool second_passed = now >= next_second_;
  if (changed || second_passed) {
    outlet_.publish_status(reports_, changed);
    words_changed_ = false;
  }
  if (second_passed) {
    outlet_.publish_health(reports_);
    next_second_ = now + std::chrono::seconds(1);
  }
}

void PublisherStage::describe(StageReport& report) const noexcept {
  report.state = outputs_ == 0 ? StageState::kStarting : StageState::kRunning;
  report.outputs = outputs_;
  report.dropped = too_old_;
}

}  // namespace tubed
