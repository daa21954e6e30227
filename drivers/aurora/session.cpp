#include "drivers/aurora/session.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kInitTimeout{5000};   // 50 ms recorded
constexpr milliseconds kHaltTimeout{2000};   // 0.36 s recorded
constexpr milliseconds kStartTimeout{6000};  // 2.0 s recorded
constexpr milliseconds kRateTimeout{1000};
constexpr milliseconds kIdentifyTimeout{500};
constexpr int kAttempts = 3;
constexpr milliseconds kQuietAfterTrouble{30};
// PHINF with tool and plug: 64 bytes, and the tracker's and an adapter's time.
constexpr int kUnchangedReply = 64;
constexpr milliseconds kUnchangedTimeout{60};
constexpr int kIdleStartsUntilComplaint = 2;
constexpr milliseconds kCloseHalt{1000};
constexpr milliseconds kCloseRate{300};

}  // namespace

Session::Session(const SessionSettings& settings, const CoilMap& coils, std::span<const ToolDefinition> tools)
    : coils_(coils),
      exchange_(settings.trace_capacity),
      rates_(settings.baud),
      ports_(coils, tools),
      poller_(settings.poller, coils) {}

void Session::attach(ByteChannel& channel) noexcept {
  exchange_.attach(channel);
  if (resumption_.possible()) {
    search_.begin_after_loss(tracking_rate_);
  } else {
    search_.begin(rates_.wanted());
  }
  rates_.forget();
  verifying_rate_ = false;
  wait_until_ = exchange_.now();
  enter(Phase::kSearch);
}

Session::Event Session::run(MonotonicTime deadline, EmFrame& frame) noexcept {
  if (!exchange_.attached()) {
    return Event::kGone;
  }
  for (;;) {
    if (problem_waits_) {
      problem_waits_ = false;
      return Event::kProblem;
    }
    if (phase_ == Phase::kTrack) {
      const Event event = track(deadline, frame);
      if (event != Event::kQuiet || exchange_.now() >= deadline) {
        return event;
      }
      continue;
    }
    if (!exchange_.pending() && exchange_.now() >= wait_until_) {
      send_next();
    }
    Reply reply;
    switch (exchange_.listen(exchange_.pending() ? deadline : std::min(deadline, wait_until_), reply)) {
      case Exchange::Event::kGone:
        exchange_.detach();
        return Event::kGone;
      case Exchange::Event::kReply:
        if (reply.kind == ReplyKind::kReset) {
          was_reset();
        } else if (exchange_.answers()) {
          take(&reply);
        }
        break;
      case Exchange::Event::kNoReply:
        take(nullptr);
        break;
      case Exchange::Event::kQuiet:
        if (exchange_.now() >= deadline) {
          return Event::kQuiet;
        }
        break;
    }
  }
}

MonotonicTime Session::due() const noexcept {
  if (!exchange_.attached() || problem_waits_) {
    return {};
  }
  if (exchange_.pending()) {
    return exchange_.give_up_at();
  }
  return phase_ == Phase::kTrack ? poller_.due(exchange_) : wait_until_;
}

Session::Event Session::track(MonotonicTime deadline, EmFrame& frame) noexcept {
  switch (poller_.step(exchange_, deadline, frame)) {
    case Poller::Event::kQuiet:
      return Event::kQuiet;
    case Poller::Event::kMeasurement:
      idle_starts_ = 0;
      trouble_.clear();
      return Event::kMeasurement;
    case Poller::Event::kRefused:
      return Event::kRefused;
    case Poller::Event::kPortsChanged:
      if (poller_.handles_contradict()) {
        complain(contradiction());
      }
      halt_then(Phase::kPorts);
      return Event::kQuiet;
    case Poller::Event::kNotTracking:
      if (++idle_starts_ >= kIdleStartsUntilComplaint) {
        complain(Problem("the tracker was started but measures nothing; switch it off and on"));
      }
      halt_then(Phase::kInitialise);
      return Event::kQuiet;
    case Poller::Event::kStandstill: {
      Problem words("the tracker answers, but its frame counter stands still at ");
      words.hex(poller_.newest_number(), 8) << ": nothing new is measured; tracking is started again; if it "
                                               "stays, switch the tracker off and on";
      complain(words);
      halt_then(Phase::kInitialise);
      return Event::kQuiet;
    }
    case Poller::Event::kReset:
      was_reset();
      return Event::kQuiet;
    case Poller::Event::kSilent:
      ++counts_.link_losses;
      search_again();
      return Event::kQuiet;
    case Poller::Event::kGone:
      break;
  }
  exchange_.detach();
  return Event::kGone;
}

void Session::enter(Phase phase) noexcept {
  if (phase != Phase::kSearch && phase != Phase::kTrack) {
    resumption_.forget();
  }
  phase_ = phase;
  attempts_ = 0;
  search_step_begun_ = false;
  if (phase == Phase::kPorts) {
    ++counts_.port_setups;
    ports_.begin();
  }
}

void Session::halt_then(Phase phase) noexcept {
  exchange_.abandon();
  after_halt_ = phase;
  enter(Phase::kHalt);
}

void Session::search_again() noexcept {
  exchange_.trace().note(exchange_.now(), "the tracker has fallen silent");
  const auto rate = baud_rate(exchange_.baud());
  search_.begin_after_loss(rate && *rate != BaudRate::k9600 ? *rate : rates_.wanted());
  enter(Phase::kSearch);
}

// It has forgotten everything and listens at 9600 baud.
void Session::was_reset() noexcept {
  ++counts_.resets;
  exchange_.trace().note(exchange_.now(), "the tracker has started anew");
  verifying_rate_ = false;
  if (exchange_.baud() != bits_per_second(BaudRate::k9600)) {
    exchange_.set_baud(bits_per_second(BaudRate::k9600));
  }
  exchange_.abandon();
  enter(Phase::kInitialise);
}

void Session::complain(const Problem& problem) noexcept {
  problem_ = trouble_ = problem;
  problem_waits_ = true;
  exchange_.trace().note(exchange_.now(), problem.text());
}

// An answer that was only late comes while nothing is asked.
bool Session::retry() noexcept {
  wait_until_ = exchange_.now() + kQuietAfterTrouble;
  return ++attempts_ < kAttempts;
}

void Session::send(const CommandLine& command, std::chrono::nanoseconds timeout) noexcept {
  exchange_.send(command, timeout);
}

void Session::send_next() noexcept {
  switch (phase_) {
    case Phase::kSearch:
      send_search();
      break;
    case Phase::kHalt:
      send(tstop_command(), kHaltTimeout);
      break;
    case Phase::kInitialise:
      send(init_command(), kInitTimeout);
      break;
    case Phase::kIdentify:
      send(identity_question(), kIdentifyTimeout);
      break;
    case Phase::kSetRate:
      send(comm_command({.rate = rates_.best()}), kRateTimeout);
      break;
    case Phase::kPorts:
      send(ports_.command(), ports_.timeout());
      break;
    case Phase::kStart:
      send(tstart_command(), kStartTimeout);
      break;
    case Phase::kTrack:
      break;
  }
}

void Session::send_search() noexcept {
  const SearchStep step = search_.step();
  if (!search_step_begun_) {
    search_step_begun_ = true;
    attempts_ = 0;
    exchange_.set_baud(bits_per_second(step.rate));
    if (step.serial_break) {
      exchange_.send_break();
    }
    search_step_ends_ = exchange_.now() + step.timeout;
    resumption_.begin();
  }
  asking_unchanged_ = resumption_.possible() && step.rate == tracking_rate_ && !step.serial_break;
  if (asking_unchanged_) {
    send(resumption_.command(), kUnchangedReply * exchange_.byte_time() + kUnchangedTimeout);
  } else {
    send(init_command(), LinkSearch::kBetweenTries);
  }
}

void Session::take(const Reply* reply) noexcept {
  switch (phase_) {
    case Phase::kSearch:
      return take_search(reply);
    case Phase::kHalt:
      return take_halt(reply);
    case Phase::kInitialise:
      return take_initialise(reply);
    case Phase::kIdentify:
      return take_identify(reply);
    case Phase::kSetRate:
      return take_rate(reply);
    case Phase::kPorts:
      return take_ports(reply);
    case Phase::kStart:
      return take_start(reply);
    case Phase::kTrack:
      break;
  }
}

// Any reply whose check sum is right says that the rate is right.
void Session::take_search(const Reply* reply) noexcept {
  if (reply != nullptr && asking_unchanged_) {
    take_unchanged(*reply);
  } else if (reply != nullptr) {
    ++counts_.links;
    verifying_rate_ = false;
    if (carried_out(reply)) {
      initialised();
    } else {
      halt_then(Phase::kInitialise);
    }
  } else {
    not_found();
  }
}

void Session::not_found() noexcept {
  if (exchange_.now() < search_step_ends_) {
    return;
  }
  search_step_begun_ = false;
  if (!search_.advance()) {
    complain(Problem(
        "the tracker does not answer at any rate; check its power, its cable and that this is its port"));
  }
}

// Behind a line that was interrupted the tracker has gone on.
void Session::take_unchanged(const Reply& reply) noexcept {
  switch (resumption_.take(reply)) {
    case Resumption::Answer::kGoOn:
      break;
    case Resumption::Answer::kAgain:
      not_found();
      break;
    case Resumption::Answer::kSame:
      ++counts_.links;
      ++counts_.resumptions;
      exchange_.trace().note(exchange_.now(), "it tracks the same coils as before");
      poller_.resume(exchange_.now());
      enter(Phase::kTrack);
      break;
    case Resumption::Answer::kOther:
      ++counts_.links;
      halt_then(Phase::kInitialise);
      break;
  }
}

void Session::close() noexcept {
  resumption_.forget();
  if (!exchange_.attached()) {
    return;
  }
  exchange_.abandon();
  const bool found = phase_ != Phase::kSearch;
  if (phase_ == Phase::kTrack || phase_ == Phase::kStart || phase_ == Phase::kHalt) {
    command_and_wait(tstop_command(), kCloseHalt);
  }
  constexpr int kFirstRate = 9600;
  if (found && exchange_.baud() != kFirstRate && command_and_wait(comm_command({}), kCloseRate)) {
    exchange_.set_baud(kFirstRate);
  }
  exchange_.trace().note(exchange_.now(), "closed");
  exchange_.detach();
}

// Answers to what was asked before may come first.
bool Session::command_and_wait(const CommandLine& command, std::chrono::nanoseconds timeout) noexcept {
  exchange_.send(command, timeout);
  const MonotonicTime deadline = exchange_.now() + timeout;
  Reply reply;
  for (;;) {
    const Exchange::Event event = exchange_.listen(deadline, reply);
    if (event == Exchange::Event::kReply && (carried_out(&reply) || reply.kind == ReplyKind::kError)) {
      return carried_out(&reply);
    }
    if (event != Exchange::Event::kReply || exchange_.now() >= deadline) {
      return false;
    }
  }
}

}  // namespace tubed::aurora
