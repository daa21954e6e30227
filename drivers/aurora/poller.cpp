#include "drivers/aurora/poller.hpp"

#include <algorithm>
#include <utility>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/error_codes.hpp"
#include "drivers/aurora/tx_reply.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint16_t kOptions = kTransforms | kAlsoOutOfVolume;
constexpr std::size_t kTextBytesAHandle = 72;
constexpr std::size_t kTextBytesBeside = 16;

/// After a reply that was lost or late another may be on its way: the line has to be quiet for so long.
constexpr milliseconds kQuietAfterTrouble{5};
constexpr milliseconds kMaxPauseInReply{20};

constexpr int kFailuresUntilSilent = 10;  // polls without answer until the link is looked for
constexpr int kErrorsUntilRestart = 5;
constexpr int kContradictionsUntilRestart = 4;
constexpr seconds kStandstill{1};  // no new measurement for so long although the tracker answers
/// How often, and by how much, a question is asked before the earliest instant that is possible.
constexpr seconds kProbeEvery{3};
constexpr milliseconds kProbeAhead{2};
/// A tracker that takes longer than this to begin its answer is late.
constexpr milliseconds kMaxTurnaround{10};
/// Between two steps: then it was this program that stood still, or its machine, and nobody was asked.
constexpr milliseconds kOwnAbsence{250};

/// After an interruption of so long the times of measurement are found anew.
constexpr seconds kClockLasts{5};

/// A time of measurement is the middle of what is possible: off by half of this at most.
constexpr milliseconds kMaxTimeUncertainty{40};
/// A tracker whose counter stands still is started anew after 1, 2, 4, 8 s.
constexpr int kMaxStandstillDoublings = 3;

bool unknown_command(std::uint8_t code) noexcept {
  return code == 0x01 || code == 0x23 || code == 0x32 || code == 0x33;
}

}  // namespace

// The frame admission is kept: it recognises a number from before, whatever was done to the tracker
// meanwhile.
void Poller::start(std::span<const TrackedHandle> handles, std::span<const std::uint8_t> found,
                   MonotonicTime now) noexcept {
  handle_count_ = std::min(handles.size(), tracked_.size());
  std::copy_n(handles.begin(), handle_count_, tracked_.begin());
  std::array<std::uint8_t, kMaxTrackerCoils> numbers{};
  const auto end = tracked_.begin() + static_cast<std::ptrdiff_t>(handle_count_);
  std::transform(tracked_.begin(), end, numbers.begin(),
                 [](const TrackedHandle& tracked) { return tracked.handle; });
  simulated_ =
      std::any_of(tracked_.begin(), end, [](const TrackedHandle& tracked) { return tracked.simulated; });
  handles_.start(std::span(numbers).first(handle_count_), found);
  tolerant_ = std::exchange(contradicted_, false);
  newest_ = {};
  system_status_ = {};
  admission_.tracking_started();
  counter_.reset();
  clock_.reset();
  guard_.reset();
  plugs_.start();
  begin_to_poll(now);
  first_seen_ = poll_at_once_ = false;
  last_new_ = now;
  settling_polls_ = 0;
  int placed = 0;
  for (int coil = 0; coil < coils_.coil_count(); ++coil) {
    placed += coils_.plug(coil) ? 1 : 0;
  }
  coil_absent_ = static_cast<int>(handle_count_) < placed;
}

// The number of the next measurement has to fit the one before the interruption. An answer to a question from
// before it may come first.
void Poller::resume(MonotonicTime now) noexcept {
  begin_to_poll(now);
  poll_at_once_ = true;
  settling_polls_ = 2;
}

void Poller::begin_to_poll(MonotonicTime now) noexcept {
  ports_changed_ = false;
  errors_in_a_row_ = contradictions_ = 0;
  encoding_.begin(now);
  forget_unverified();
  hold_until_ = still_since_ = last_step_ = now;
}

Poller::Event Poller::step(Exchange& exchange, MonotonicTime deadline, EmFrame& frame) noexcept {
  for (;;) {
    const MonotonicTime now = exchange.now();
    still_since_ = now - last_step_ > kOwnAbsence ? now : still_since_;
    last_step_ = now;
    if (ports_changed_) {
      ports_changed_ = false;
      return Event::kPortsChanged;
    }
    if (now - still_since_ > kStandstill * (1 << standstills_) && encoding_.failures() == 0 &&
        !exchange.pending()) {
      still_since_ = now;
      standstills_ = std::min(standstills_ + 1, kMaxStandstillDoublings);
      return Event::kStandstill;
    }
    const MonotonicTime due = next_poll(exchange);
    if (!exchange.pending() && now >= due) {
      poll(exchange);
    }
    Reply reply;
    const MonotonicTime until = exchange.pending() ? deadline : std::min(deadline, due);
    Event event = Event::kQuiet;
    switch (exchange.listen(until, reply)) {
      case Exchange::Event::kGone:
        return Event::kGone;
      case Exchange::Event::kNoReply:
        event = unanswered(exchange.now());
        break;
      case Exchange::Event::kReply:
        event = answered(reply, exchange, frame);
        break;
      case Exchange::Event::kQuiet:
        break;
    }
    if (event != Event::kQuiet || exchange.now() >= deadline) {
      return event;
    }
  }
}

MonotonicTime Poller::next_poll(const Exchange& exchange) const noexcept {
  MonotonicTime due = hold_until_;
  if (exchange.inside_reply()) {
    due = std::max(due, exchange.last_byte() + kMaxPauseInReply);
  }
  if (!poll_at_once_ && first_seen_) {
    // The tracker has the question in the middle of what is possible: soon after the measurement, and every
    // answer makes the range smaller.
    constexpr std::int64_t kCommandBytes = 12;
    const FrameClock::Range range = clock_.range(measurement_ + 1);
    const MonotonicTime heard = probe_ ? range.earliest - kProbeAhead : range.middle();
    due = std::max(due, heard - kCommandBytes * exchange.byte_time());
  }
  return due;
}

void Poller::poll(Exchange& exchange) noexcept {
  const bool text = encoding_.ask_in_text(exchange.now());
  // Every handle that the tracker has allocated may be there, those that are not tracked without a pose.
  const std::size_t handles = std::max(handle_count_, handles_.reported().size());
  const std::size_t bytes =
      text ? handles * kTextBytesAHandle + kTextBytesBeside : kBxHeaderSize + 3 + handles * 42 + kBxCrcSize;
  const auto on_the_wire = static_cast<std::int64_t>(bytes) * exchange.byte_time();
  ++counts_.polls;
  poll_at_once_ = probe_ = false;
  settling_polls_ = std::max(settling_polls_ - 1, 0);
  take_verified();
  exchange.send(text ? tx_command(kOptions) : bx_command(kOptions), on_the_wire + settings_.reply_margin,
                Exchange::ReplyWait::kWhileTalking);
}

Poller::Event Poller::unanswered(MonotonicTime now) noexcept {
  ++counts_.unanswered;
  encoding_.unanswered();
  hold_until_ = now + kQuietAfterTrouble;
  settling_polls_ = 2;
  poll_at_once_ = true;
  return encoding_.failures() >= kFailuresUntilSilent ? Event::kSilent : Event::kRefused;
}

// Another reply may follow this one: it would be taken for the answer to the next question, and every time
// after it would be late. A tracker that has heard the last question begins to answer within its usual time.
void Poller::settle(MonotonicTime now) noexcept {
  hold_until_ = now + kQuietAfterTrouble + 2 * turnaround_;
  verified_by_quiet_ = true;
}

Poller::Event Poller::answered(const Reply& reply, Exchange& exchange, EmFrame& frame) noexcept {
  const MonotonicTime now = exchange.now();
  if (settling_polls_ > 0) {
    hold_until_ = now + kQuietAfterTrouble + 2 * turnaround_;  // answers to earlier polls may follow
  }
  switch (reply.kind) {
    case ReplyKind::kReset:
      return Event::kReset;
    case ReplyKind::kError:
      return error(reply.error_code, now);
    case ReplyKind::kBinary:
    case ReplyKind::kText:
      if (decode(reply)) {
        errors_in_a_row_ = 0;
        counts_.tx_fallbacks += encoding_.understood(reply.kind == ReplyKind::kBinary, now) ? 1 : 0;
        return measured(exchange, frame);
      }
      [[fallthrough]];
    case ReplyKind::kOkay:
    case ReplyKind::kWarning:
      break;
  }
  return unanswered(now);
}

Poller::Event Poller::error(std::uint8_t code, MonotonicTime now) noexcept {
  ++counts_.errors;
  ++errors_in_a_row_;
  hold_until_ = now + kQuietAfterTrouble;
  poll_at_once_ = true;
  if (!encoding_.asked_in_text() && unknown_command(code)) {
    encoding_.not_known(code);
    return encoding_.failures() >= kFailuresUntilSilent ? Event::kNotTracking : Event::kRefused;
  }
  const bool may_help_to_repeat = describe_error(code).remedy == Remedy::kRetry;
  const int most = may_help_to_repeat ? kFailuresUntilSilent : kErrorsUntilRestart;
  return errors_in_a_row_ >= most ? Event::kNotTracking : Event::kRefused;
}

bool Poller::decode(const Reply& reply) noexcept {
  return reply.kind == ReplyKind::kBinary ? decode_bx(reply.payload, reply_)
                                          : decode_tx(reply.text(), reply_);
}

Poller::Event Poller::refused() noexcept {
  ++counts_.refused;
  poll_at_once_ = true;
  return Event::kRefused;
}

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
