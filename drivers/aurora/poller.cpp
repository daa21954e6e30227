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

constexpr milliseconds kMaxPauseInReply{20};

constexpr int kFailuresUntilSilent = 10;  // polls without answer until the link is looked for
constexpr int kErrorsUntilRestart = 5;
constexpr seconds kStandstill{1};  // no new measurement for so long although the tracker answers
/// By how much a question is asked before the earliest instant that is possible, now and then.
constexpr milliseconds kProbeAhead{2};
/// Between two steps: then it was this program that stood still, or its machine, and nobody was asked.
constexpr milliseconds kOwnAbsence{250};

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
  tracked_.start(handles);
  handles_.start(tracked_.numbers(), found);
  tolerant_ = std::exchange(contradicted_, false);
  system_status_ = {};
  admission_.tracking_started();
  counter_.reset();
  times_.restart();
  guard_.reset();
  plugs_.start();
  begin_to_poll(now);
  first_seen_ = poll_at_once_ = false;
  last_new_ = now;
  settling_polls_ = 0;
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
  times_.forget_unverified();
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
    const FrameClock::Range range = times_.clock().range(measurement_ + 1);
    const MonotonicTime heard = probe_ ? range.earliest - kProbeAhead : range.middle();
    due = std::max(due, heard - kCommandBytes * exchange.byte_time());
  }
  return due;
}

void Poller::poll(Exchange& exchange) noexcept {
  const bool text = encoding_.ask_in_text(exchange.now());
  // Every handle that the tracker has allocated may be there, those that are not tracked without a pose.
  const std::size_t handles = std::max(tracked_.count(), handles_.reported().size());
  const std::size_t bytes =
      text ? handles * kTextBytesAHandle + kTextBytesBeside : kBxHeaderSize + 3 + handles * 42 + kBxCrcSize;
  const auto on_the_wire = static_cast<std::int64_t>(bytes) * exchange.byte_time();
  ++counts_.polls;
  poll_at_once_ = probe_ = false;
  settling_polls_ = std::max(settling_polls_ - 1, 0);
  times_.asked();
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
  hold_until_ = now + kQuietAfterTrouble + 2 * times_.turnaround();
  times_.quiet_follows();
}

Poller::Event Poller::answered(const Reply& reply, Exchange& exchange, EmFrame& frame) noexcept {
  const MonotonicTime now = exchange.now();
  if (settling_polls_ > 0) {
    hold_until_ = now + kQuietAfterTrouble + 2 * times_.turnaround();  // answers to earlier polls may follow
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

}  // namespace tubed::aurora
