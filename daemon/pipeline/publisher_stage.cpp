#include "daemon/pipeline/publisher_stage.hpp"

#include <cstdio>

#include "idl/estimate_age.hpp"

namespace tubed {

namespace {
// Words that change at every measurement do not flood DDS.
constexpr std::chrono::milliseconds kBetweenWords{100};

bool same_word(const InstrumentStatus& a, const InstrumentStatus& b) {
  return a.validity == b.validity && a.reasons == b.reasons;
}

// In doubling steps, so that a stage that hangs for an hour does not say so in a new line every second.
void say_silence(std::chrono::nanoseconds silence, StageReport& report) {
  const double silence_s = std::chrono::duration<double>(silence).count();
  double said_s = std::chrono::duration<double>(kSilence).count();
  while (2 * said_s <= silence_s) {
    said_s *= 2;
  }
  std::snprintf(report.why.data(), report.why.size(), "no sign of life for %g s", said_s);
}

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
    if (is_history(estimate, to_ns(now))) {
      ++too_old_;
      continue;
    }
    any = true;
    if (!outlet_.publish(estimate)) {
      ++not_written_;
      continue;
    }
    ++outputs_;
    instruments_[i].validity = estimate.validity;
    instruments_[i].reasons = estimate.reasons;
    instruments_[i].written = now;
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

void PublisherStage::gather_stages(MonotonicTime now) {
  reports_.clear();
  gather_(reports_);
  stages_.resize(reports_.size());
  silent_.resize(reports_.size());
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    const StageReport& report = *reports_[i].report;
    if (report.reported_ns == 0) {
      continue;  // still at its first step, which may open a device
    }
    const MonotonicTime falls_silent = from_ns(report.reported_ns) + reports_[i].max_silence;
    if (now < falls_silent) {
      next_silence_ = std::min(next_silence_, falls_silent);
      continue;
    }
    silent_[i] = report;
    silent_[i].state = StageState::kFailed;
    silent_[i].since_ns = to_ns(falls_silent);
    say_silence(now - from_ns(report.reported_ns), silent_[i]);
    reports_[i].report = &silent_[i];
  }
}

// An optimizer that hangs must not look VALID.
void PublisherStage::judge_instruments(MonotonicTime now) {
  for (std::size_t i = 0; i < instruments_.size(); ++i) {
    const Instrument& instrument = instruments_[i];
    statuses_[i] = {instrument.validity, instrument.reasons, -1};
    if (instrument.written == MonotonicTime{}) {
      continue;
    }
    statuses_[i].estimate_age_ns = std::chrono::nanoseconds(now - instrument.written).count();
    if (now < instrument.written + kSilence) {
      next_silence_ = std::min(next_silence_, instrument.written + kSilence);
    } else {
      statuses_[i].validity = Validity::kNotAvailable;
      statuses_[i].reasons.add(Reason::kDeadlineMissed);
    }
  }
}

void PublisherStage::publish_reports(MonotonicTime now) {
  next_silence_ = MonotonicTime::max();
  gather_stages(now);
  judge_instruments(now);
  log_changes(now);
  const bool second_passed = now >= next_second_;
  if (second_passed || outlet_.is_status_due() || status_is_due(now)) {
    outlet_.publish_status({reports_, statuses_});
    for (std::size_t i = 0; i < reports_.size(); ++i) {
      stages_[i].state = reports_[i].report->state;
      stages_[i].words = reports_[i].report->why.data();
    }
    published_ = statuses_;
    next_words_ = now + kBetweenWords;
  }
  if (second_passed) {
    outlet_.publish_health(reports_);
    next_second_ = now + std::chrono::seconds(1);
  }
}

bool PublisherStage::status_is_due(MonotonicTime now) const {
  bool state_changed = !std::equal(statuses_.begin(), statuses_.end(), published_.begin(), same_word);
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
    if (instruments_[i].lines.is_due(statuses_[i].validity, statuses_[i].reasons, now)) {
      outlet_.log_validity(static_cast<std::uint32_t>(i), statuses_[i]);
    }
  }
}

void PublisherStage::describe(StageReport& report) const noexcept {
  report.state = outputs_ == 0 ? StageState::kStarting : StageState::kRunning;
  report.outputs = outputs_;
  report.dropped = too_old_ + not_written_;
}

}  // namespace tubed
