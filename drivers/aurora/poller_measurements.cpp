// What a measurement of the tracker is worth to the Poller: whether its handles and its number are believed,
// when it was made, and what is passed on.
#include <algorithm>
#include <utility>

#include "drivers/aurora/poller.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kContradictionsUntilRestart = 4;
/// How often a question is asked before the earliest instant that is possible.
constexpr seconds kProbeEvery{3};
/// A tracker that takes longer than this to begin its answer is late.
constexpr milliseconds kMaxTurnaround{10};
/// After an interruption of so long the times of measurement are found anew.
constexpr seconds kClockLasts{5};
/// A time of measurement is the middle of what is possible: off by half of this at most.
constexpr milliseconds kMaxTimeUncertainty{40};

}  // namespace

// A contradiction that stays when the ports have been initialised again is not resolved by doing that for
// ever: then the replies are taken for what they have.
bool Poller::handles_agree() noexcept {
  agreement_ = handles_.compare(reply_);
  switch (agreement_) {
    case ReportedHandles::Agreement::kComplete:
      return true;
    case ReportedHandles::Agreement::kForeignEnabled:
    case ReportedHandles::Agreement::kTrackedAbsent:
      return tolerant_;
    case ReportedHandles::Agreement::kTwice:
      break;
  }
  return false;
}

Poller::Event Poller::contradicted() noexcept {
  refused();
  contradicted_ = ++contradictions_ >= kContradictionsUntilRestart;
  return contradicted_ ? Event::kPortsChanged : Event::kRefused;
}

Poller::Event Poller::measured(Exchange& exchange, EmFrame& frame) noexcept {
  const MonotonicTime now = exchange.now();
  if (!exchange.answers()) {
    ++counts_.unsolicited;
    forget_unverified();  // what came before it was no answer to the last question: this is
  }
  if (!handles_agree()) {
    return contradicted();
  }
  const auto number = common_frame(reply_);
  if (!number) {
    return without_number(now);
  }
  const bool nothing_yet = !first_seen_ && *number == 0 &&
                           std::none_of(reply_.readings().begin(), reply_.readings().end(),
                                        [](const HandleReading& r) { return r.report == Report::kValid; });
  if (nothing_yet) {
    return Event::kQuiet;  // what the first reply after TSTART says before anything was measured
  }
  newest_number_ = *number;
  contradictions_ = 0;
  switch (admission_.judge(*number, now, period_ns_)) {
    case FrameAdmission::Verdict::kHeldBack:
      return held_back();
    case FrameAdmission::Verdict::kConfirmed:
      counter_.reset();
      clock_.reset();
      forget_unverified();
      break;
    case FrameAdmission::Verdict::kExpected:
      break;
  }
  if (static_cast<std::int32_t>(*number - admission_.last()) < 0) {
    forget_unverified();
    settle(now);  // a late reply: others may follow
    return refused();
  }
  const FrameStep step = counter_.observe(*number);
  if (first_seen_ && now - last_new_ > kClockLasts) {
    clock_.reset();
    forget_unverified();
  }
  if (step.kind == FrameKind::kDuplicate) {
    return repeated(exchange);
  }
  measurement_ = step.measurement;
  counts_.missed += step.missed;
  learn_time(exchange);
  return deliver(now, frame);
}

// The first number after TSTART is always held back; later ones are when the counter contradicts the time.
Poller::Event Poller::held_back() noexcept { return first_seen_ ? refused() : Event::kQuiet; }

// Either the question came too early, or this is a copy, and the answer to the question is still to come:
// then it comes behind the answer to the next question, after which the line is kept quiet. That next
// question is asked at once: a measurement is lost otherwise where a reply takes most of a period.
Poller::Event Poller::repeated(Exchange& exchange) noexcept {
  ++counts_.duplicates;
  poll_at_once_ = true;
  if (exchange.answers() && settling_polls_ == 0) {
    remember_question(exchange.asked());
    verified_by_quiet_ = false;
  }
  if (++repetitions_ > 1) {
    settle(exchange.now());
  }
  return Event::kQuiet;
}

void Poller::remember_question(MonotonicTime asked) noexcept {
  unverified_[unverified_count_] = {measurement_ + 1, asked};
  unverified_count_ = std::min(unverified_count_ + 1, unverified_.size() - 1);
}

void Poller::take_verified() noexcept {
  if (!std::exchange(verified_by_quiet_, false)) {
    return;
  }
  for (std::size_t i = 0; i < unverified_count_ && clock_.started(); ++i) {
    clock_.not_there(unverified_[i].measurement, unverified_[i].asked);
  }
  forget_unverified();
}

void Poller::learn_time(Exchange& exchange) noexcept {
  // An answer to an earlier question says nothing about what was there when this one was sent.
  const bool in_step = exchange.answers() && settling_polls_ == 0;
  if (!in_step || unverified_count_ > 0) {
    clock_.observe(measurement_, std::nullopt, exchange.answered());
    if (in_step) {
      remember_question(exchange.asked());
      settle(exchange.now());
    }
    return;
  }
  constexpr int kMemory = 16;
  const auto turnaround = std::clamp<std::chrono::nanoseconds>(exchange.answered() - exchange.asked(),
                                                               std::chrono::nanoseconds(0), kMaxTurnaround);
  turnaround_ += (turnaround - turnaround_) / kMemory;
  clock_.observe(measurement_, exchange.asked(), exchange.answered());
  period_ns_ = clock_.knows_period() ? clock_.period_ns() : period_ns_;
}

// A tracker that now and then answers with an old measurement proves what is not so, and every question is
// asked a little later than the one before. A question that comes early, and is answered with a new
// measurement, ends that.
void Poller::schedule_probe(MonotonicTime now) noexcept {
  if (now >= probe_at_) {
    probe_ = true;
    probe_at_ = now + kProbeEvery;
  }
}

Poller::Event Poller::deliver(MonotonicTime now, EmFrame& frame) noexcept {
  last_new_ = still_since_ = now;
  standstills_ = repetitions_ = 0;
  schedule_probe(now);
  take_readings(now);
  if (clock_.range(measurement_).width() > kMaxTimeUncertainty) {
    return refused();  // the next answer in time says when
  }
  first_seen_ = true;
  fill(frame, measurement_, now);
  if (!guard_.believe(frame)) {
    ++counts_.refused;
    return Event::kRefused;
  }
  last_time_ = frame.measured;
  ++counts_.measurements;
  return Event::kMeasurement;
}

// All handles are disabled: every plug has been pulled. There is nothing to lose by looking at the ports.
Poller::Event Poller::without_number(MonotonicTime now) noexcept {
  const bool all_gone =
      std::all_of(reply_.readings().begin(), reply_.readings().end(), [](const HandleReading& reading) {
        return reading.report == Report::kDisabled || reading.report == Report::kUnoccupied;
      });
  if (all_gone) {
    hold_until_ = now + kQuietAfterTrouble;
    ++counts_.refused;
    return ++contradictions_ >= kContradictionsUntilRestart ? Event::kPortsChanged : Event::kRefused;
  }
  return contradicted();
}

bool Poller::has_lost(std::uint8_t handle) const noexcept {
  for (std::size_t i = 0; i < handle_count_; ++i) {
    const Report report = newest_[i].report;
    if (tracked_[i].handle == handle) {
      return report == Report::kDisabled || report == Report::kUnoccupied;
    }
  }
  return false;
}

void Poller::take_readings(MonotonicTime now) noexcept {
  bool absent = coil_absent_;
  const auto readings = reply_.readings();
  for (std::size_t i = 0; i < handle_count_; ++i) {
    const auto found = std::find_if(readings.begin(), readings.end(), [&](const HandleReading& reading) {
      return reading.handle == tracked_[i].handle;
    });
    newest_[i] = HandleReading{};
    newest_[i].report = Report::kDisabled;  // a reply without it
    if (found != readings.end()) {
      newest_[i] = *found;
    }
    absent |= newest_[i].report == Report::kDisabled || newest_[i].report == Report::kUnoccupied;
  }
  system_status_ = reply_.system_status;
  ports_changed_ |= plugs_.look(
      {.coil_absent = absent, .newcomer = handles_.newcomer() >= 0, .status = system_status_}, now);
}

void Poller::fill(EmFrame& frame, std::uint64_t measurement, MonotonicTime now) const noexcept {
  frame.received = now;
  frame.measured = clock_.range(measurement).middle() - settings_.latency;
  frame.measured = std::max(frame.measured, last_time_ + std::chrono::microseconds(1));
  frame.tracker_frame = newest_number_;
  frame.origin = simulated_ ? Origin::kSimulated : Origin::kDevice;
  frame.coil_count = coils_.coil_count();
  CoilSample absent;
  absent.status = CoilStatus::kDisabled;
  std::fill_n(frame.coils.begin(), frame.coil_count, absent);
  for (std::size_t i = 0; i < handle_count_; ++i) {
    frame.coils[static_cast<std::size_t>(tracked_[i].coil)] = coil_sample(newest_[i]);
  }
}

}  // namespace tubed::aurora
