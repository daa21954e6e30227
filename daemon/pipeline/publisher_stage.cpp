#include "daemon/pipeline/publisher_stage.hpp"

namespace tubed {

namespace {
// An estimate begun before a stall is history, also when it was finished afterwards: the process may have
// been stopped in the middle of it. The next one is at most a period away.
constexpr std::chrono::milliseconds kOldEstimate{150};
constexpr std::chrono::milliseconds kBetweenWords{
    100};  // words that change at every measurement do not flood DDS
}  // namespace

bool PublisherStage::step(const Clock& clock) noexcept {
  const MonotonicTime now = clock.now();
  const bool any_estimate = publish_estimates(now);
  const bool any_em = publish_em();
  publish_tracker();
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
    Instrument& instrument = instruments_[i];
    validity_changed_ = validity_changed_ || instrument.validity != estimate.validity ||
                        !(instrument.reasons == estimate.reasons);
    instrument.validity = estimate.validity;
    instrument.reasons = estimate.reasons;
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

void PublisherStage::publish_tracker() {
  if (tracker_.fetch()) {
    outlet_.publish_tracker(tracker_.front());
  }
}

void PublisherStage::publish_reports(MonotonicTime now) {
  reports_.clear();
  gather_(reports_);
  stages_.resize(reports_.size());
  log_changes(now);
  const bool second_passed = now >= next_second_;
  if (second_passed || outlet_.is_status_due() || status_is_due(now)) {
    outlet_.publish_status(reports_);
    for (std::size_t i = 0; i < reports_.size(); ++i) {
      stages_[i].state = reports_[i].report->state;
      stages_[i].words = reports_[i].report->why.data();
    }
    validity_changed_ = false;
    next_words_ = now + kBetweenWords;
  }
  if (second_passed) {
    outlet_.publish_health(reports_);
    next_second_ = now + std::chrono::seconds(1);
  }
}

bool PublisherStage::status_is_due(MonotonicTime now) const {
  bool state_changed = validity_changed_;
  bool words_changed = false;
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    state_changed = state_changed || reports_[i].report->state != stages_[i].state;
    words_changed = words_changed || stages_[i].words != reports_[i].report->why.data();
  }
  return state_changed || (words_changed && now >= next_words_);
}

void PublisherStage::log_changes(MonotonicTime now) {
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    if (stages_[i].lines.is_due(reports_[i].report->state, reports_[i].report->why.data(), now)) {
      outlet_.log_stage(reports_[i]);
    }
  }
  for (std::size_t i = 0; i < instruments_.size(); ++i) {
    Instrument& instrument = instruments_[i];
    if (instrument.lines.is_due(instrument.validity, instrument.reasons, now)) {
      outlet_.log_validity(static_cast<std::uint32_t>(i), instrument.validity, instrument.reasons);
    }
  }
}

void PublisherStage::describe(StageReport& report) const noexcept {
  report.state = outputs_ == 0 ? StageState::kStarting : StageState::kRunning;
  report.outputs = outputs_;
  report.dropped = too_old_;
}

}  // namespace tubed
