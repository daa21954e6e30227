#include "drivers/aurora/poller.hpp"

#include <algorithm>

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
constexpr milliseconds kLongestPauseInReply{20};

constexpr int kFailuresUntilText = 4;      // polls without answer until text is tried between
constexpr int kFailuresUntilSilent = 10;   // polls without answer until the link is looked for
constexpr int kBinaryFailuresForText = 8;  // of these, binary ones beside which text worked
constexpr int kTextSuccessesForText = 3;
constexpr seconds kTryBinaryEvery{20};
constexpr int kErrorsUntilRestart = 5;
constexpr int kContradictionsUntilRestart = 4;
constexpr seconds kStandstill{1};  // no new measurement for so long although the tracker answers
/// Between two steps: then it was this program that stood still, or its machine, and nobody was asked.
constexpr milliseconds kOwnAbsence{250};

/// After an interruption of so long the times of measurement are found anew.
constexpr seconds kClockLasts{5};

/// A frame number this far from what the clock says is believed only when the next one agrees.
constexpr milliseconds kFrameNumberTolerance{500};

/// While a coil is absent and the tracker goes on saying that a port became occupied, the ports are looked at
/// again after so long: tracking stops meanwhile, so ever more seldom.
constexpr seconds kFirstLookAgain{2};
constexpr seconds kLastLookAgain{300};

bool unknown_command(std::uint8_t code) noexcept {
  return code == 0x01 || code == 0x23 || code == 0x32 || code == 0x33;
}

}  // namespace

void Poller::start(std::span<const TrackedHandle> handles, MonotonicTime now) noexcept {
  handle_count_ = std::min(handles.size(), tracked_.size());
  std::copy_n(handles.begin(), handle_count_, tracked_.begin());
  std::transform(tracked_.begin(), tracked_.begin() + static_cast<std::ptrdiff_t>(handle_count_),
                 handles_.begin(), [](const TrackedHandle& tracked) { return tracked.handle; });
  const auto end = tracked_.begin() + static_cast<std::ptrdiff_t>(handle_count_);
  simulated_ =
      std::any_of(tracked_.begin(), end, [](const TrackedHandle& tracked) { return tracked.simulated; });
  newest_ = {};
  system_status_ = {};
  counter_.reset();
  clock_.reset();
  guard_.reset();
  begin_to_poll(now);
  first_seen_ = poll_at_once_ = false;
  last_new_ = now;
  last_time_ = {};
  occupied_bit_ = occupied_known_ = false;
  settling_polls_ = 0;
  int placed = 0;
  for (int coil = 0; coil < coils_.coil_count(); ++coil) {
    placed += coils_.plug(coil) ? 1 : 0;
  }
  coil_absent_ = static_cast<int>(handle_count_) < placed;
  look_again_at_ = MonotonicTime::max();
}

// The number of the next measurement has to fit the one before the interruption. An answer to a question from
// before it may come first.
void Poller::resume(MonotonicTime now) noexcept {
  begin_to_poll(now);
  poll_at_once_ = true;
  settling_polls_ = 2;
}

void Poller::begin_to_poll(MonotonicTime now) noexcept {
  number_in_doubt_ = ports_changed_ = false;
  failures_ = errors_in_a_row_ = contradictions_ = 0;
  binary_failures_ = text_successes_ = 0;
  hold_until_ = still_since_ = last_step_ = try_binary_at_ = now;
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
    if (now - still_since_ > kStandstill && failures_ == 0 && !exchange.pending()) {
      still_since_ = now;
      return Event::kNotTracking;
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
    due = std::max(due, exchange.last_byte() + kLongestPauseInReply);
  }
  if (!poll_at_once_ && first_seen_) {
    // The tracker has the question in the middle of what is possible: soon after the measurement, and every
    // answer makes the range smaller.
    constexpr std::int64_t kCommandBytes = 12;
    due = std::max(due, clock_.range(measurement_ + 1).middle() - kCommandBytes * exchange.byte_time());
  }
  return due;
}

void Poller::poll(Exchange& exchange) noexcept {
  const MonotonicTime now = exchange.now();
  asked_text_ = text_mode_ ? now < try_binary_at_ : failures_ >= kFailuresUntilText && failures_ % 2 == 0;
  if (text_mode_ && !asked_text_) {
    try_binary_at_ = now + kTryBinaryEvery;
  }
  const std::size_t bytes = asked_text_ ? handle_count_ * kTextBytesAHandle + kTextBytesBeside
                                        : kBxHeaderSize + 3 + handle_count_ * 42 + kBxCrcSize;
  const auto on_the_wire = static_cast<std::int64_t>(bytes) * exchange.byte_time();
  ++counts_.polls;
  poll_at_once_ = false;
  settling_polls_ = std::max(settling_polls_ - 1, 0);
  exchange.send(asked_text_ ? tx_command(kOptions) : bx_command(kOptions),
                on_the_wire + settings_.reply_margin, Exchange::Patience::kWhileTalking);
}

Poller::Event Poller::unanswered(MonotonicTime now) noexcept {
  ++counts_.unanswered;
  ++failures_;
  binary_failures_ += asked_text_ ? 0 : 1;
  hold_until_ = now + kQuietAfterTrouble;
  settling_polls_ = 2;
  poll_at_once_ = true;
  return failures_ >= kFailuresUntilSilent ? Event::kSilent : Event::kRefused;
}

Poller::Event Poller::answered(const Reply& reply, Exchange& exchange, EmFrame& frame) noexcept {
  const MonotonicTime now = exchange.now();
  if (settling_polls_ > 0) {
    hold_until_ = now + kQuietAfterTrouble;  // answers to earlier polls may follow
  }
  switch (reply.kind) {
    case ReplyKind::kReset:
      return Event::kReset;
    case ReplyKind::kError:
      return error(reply.error_code, now);
    case ReplyKind::kBinary:
    case ReplyKind::kText:
      if (decode(reply)) {
        link_works(reply.kind == ReplyKind::kBinary, now);
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
  if (!asked_text_ && unknown_command(code)) {
    binary_failures_ += 2;
    failures_ = std::max(failures_ + 1, kFailuresUntilText);
    return failures_ >= kFailuresUntilSilent ? Event::kNotTracking : Event::kRefused;
  }
  const bool may_help_to_repeat = describe_error(code).remedy == Remedy::kRetry;
  const int most = may_help_to_repeat ? kFailuresUntilSilent : kErrorsUntilRestart;
  return errors_in_a_row_ >= most ? Event::kNotTracking : Event::kRefused;
}

bool Poller::decode(const Reply& reply) noexcept {
  return reply.kind == ReplyKind::kBinary ? decode_bx(reply.payload, reply_)
                                          : decode_tx(reply.text(), reply_);
}

// Text is used when binary replies fail again and again while text ones come, and binary ones are tried again
// now and then: a damaged line hurts both.
void Poller::link_works(bool binary, MonotonicTime now) noexcept {
  failures_ = errors_in_a_row_ = 0;
  if (binary) {
    binary_failures_ = text_successes_ = 0;
    text_mode_ = false;
    return;
  }
  ++text_successes_;
  const bool give_up_binary =
      binary_failures_ >= kBinaryFailuresForText && text_successes_ >= kTextSuccessesForText;
  if (!text_mode_ && give_up_binary) {
    text_mode_ = true;
    try_binary_at_ = now + kTryBinaryEvery;
    ++counts_.tx_fallbacks;
  } else if (!text_mode_) {
    failures_ = kFailuresUntilText - 1;  // ask in binary next, then in text again
  }
}

Poller::Event Poller::contradicted() noexcept {
  ++counts_.refused;
  poll_at_once_ = true;
  return ++contradictions_ >= kContradictionsUntilRestart ? Event::kPortsChanged : Event::kRefused;
}

Poller::Event Poller::measured(Exchange& exchange, EmFrame& frame) noexcept {
  const MonotonicTime now = exchange.now();
  const std::span<const std::uint8_t> handles(handles_.data(), handle_count_);
  if (!lists_exactly(reply_, handles)) {
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
  if (!believable_number(*number, now)) {
    ++counts_.refused;
    poll_at_once_ = true;
    return Event::kRefused;
  }
  const FrameStep step = counter_.observe(*number);
  if (step.kind == FrameKind::kOld) {
    ++counts_.refused;
    poll_at_once_ = true;
    return Event::kRefused;
  }
  contradictions_ = 0;
  if (step.kind == FrameKind::kRestarted || (first_seen_ && now - last_new_ > kClockLasts)) {
    clock_.reset();
  }
  measurement_ = step.measurement;
  // An answer to an earlier poll says nothing about what was there when this one was sent.
  const bool late = settling_polls_ > 0 || !exchange.answers();
  const MonotonicTime asked = late ? exchange.answered() - kStandstill : exchange.asked();
  clock_.observe(measurement_, asked, exchange.answered());
  if (step.kind == FrameKind::kDuplicate) {
    ++counts_.duplicates;
    poll_at_once_ = true;
    return Event::kQuiet;
  }
  first_seen_ = true;
  last_number_ = *number;
  last_new_ = still_since_ = now;
  counts_.missed += step.missed;
  look_at_ports(now);
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

bool Poller::believable_number(std::uint32_t number, MonotonicTime now) noexcept {
  if (!first_seen_ || number == last_number_) {
    number_in_doubt_ = false;
    return true;
  }
  const auto ahead = static_cast<std::int32_t>(number - last_number_);
  const double expected_ns = static_cast<double>((now - last_new_).count());
  const double said_ns = ahead / static_cast<double>(kCountsPerMeasurement) * clock_.period_ns();
  const auto since_doubted = static_cast<std::int32_t>(number - doubted_number_);
  const bool agrees_with_doubted = number_in_doubt_ && since_doubted >= 0 &&
                                   since_doubted <= 40 * static_cast<std::int32_t>(kCountsPerMeasurement);
  const auto tolerance_ns = static_cast<double>(std::chrono::nanoseconds(kFrameNumberTolerance).count());
  if (std::abs(said_ns - expected_ns) <= tolerance_ns || agrees_with_doubted) {
    number_in_doubt_ = false;
    return true;
  }
  number_in_doubt_ = true;
  doubted_number_ = number;
  return false;
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

void Poller::look_at_ports(MonotonicTime now) noexcept {
  bool absent = coil_absent_;
  for (std::size_t i = 0; i < handle_count_; ++i) {
    const auto readings = reply_.readings();
    const auto found = std::find_if(readings.begin(), readings.end(), [&](const HandleReading& reading) {
      return reading.handle == tracked_[i].handle;
    });
    if (found != readings.end()) {
      newest_[i] = *found;
      absent |= found->report == Report::kDisabled || found->report == Report::kUnoccupied;
    }
  }
  system_status_ = reply_.system_status;
  const bool occupied = system_status_.port_became_occupied();
  if (!absent) {
    look_again_at_ = MonotonicTime::max();
    look_again_after_ = kFirstLookAgain;
  } else if (occupied && !occupied_bit_ && occupied_known_) {
    ports_changed_ = true;
  } else if (occupied && look_again_at_ == MonotonicTime::max()) {
    look_again_at_ = now + look_again_after_;
  } else if (now >= look_again_at_) {
    ports_changed_ = true;
    look_again_after_ = std::min<std::chrono::nanoseconds>(2 * look_again_after_, kLastLookAgain);
  }
  occupied_bit_ = occupied;
  occupied_known_ = true;
}

void Poller::fill(EmFrame& frame, std::uint64_t measurement, MonotonicTime now) const noexcept {
  frame.received = now;
  frame.measured = clock_.range(measurement).middle() - settings_.latency;
  frame.measured = std::max(frame.measured, last_time_ + std::chrono::microseconds(1));
  frame.tracker_frame = last_number_;
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
