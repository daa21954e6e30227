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
    times_.forget_unverified();  // what came before it was no answer to the last question: this is
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
  switch (admission_.judge(*number, now, times_.period_ns())) {
    case FrameAdmission::Verdict::kHeldBack:
      return held_back();
    case FrameAdmission::Verdict::kConfirmed:
      counter_.reset();
      times_.restart();
      break;
    case FrameAdmission::Verdict::kExpected:
      break;
  }
  if (static_cast<std::int32_t>(*number - admission_.last()) < 0) {
    times_.forget_unverified();
    settle(now);  // a late reply: others may follow
    return refused();
  }
  const FrameStep step = counter_.observe(*number);
  if (first_seen_ && now - last_new_ > kClockLasts) {
    times_.restart();
  }
  if (step.kind == FrameKind::kDuplicate) {
    return repeated(exchange);
  }
  measurement_ = step.measurement;
  counts_.missed += step.missed;
  if (times_.observe(measurement_, answer_of(exchange))) {
    settle(exchange.now());
  }
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
  times_.repeated(measurement_, answer_of(exchange));
  if (++repetitions_ > 1) {
    settle(exchange.now());
  }
  return Event::kQuiet;
}

MeasurementTimes::Answer Poller::answer_of(const Exchange& exchange) const noexcept {
  return {exchange.asked(), exchange.answered(), exchange.answers() && settling_polls_ == 0};
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
  tracked_.take(reply_);
  system_status_ = reply_.system_status;
  ports_changed_ |= plugs_.look({.coil_absent = tracked_.coil_is_absent(),
                                 .newcomer = handles_.newcomer() >= 0,
                                 .status = system_status_},
                                now);
  if (times_.clock().range(measurement_).width() > kMaxTimeUncertainty) {
    return refused();  // the next answer in time says when
  }
  first_seen_ = true;
  fill(frame, now);
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

void Poller::fill(EmFrame& frame, MonotonicTime now) const noexcept {
  frame.received = now;
  frame.measured = times_.clock().range(measurement_).middle() - settings_.latency;
  frame.measured = std::max(frame.measured, last_time_ + std::chrono::microseconds(1));
  frame.tracker_frame = newest_number_;
  tracked_.fill(frame);
}

}  // namespace tubed::aurora
