#include "drivers/aurora/session.hpp"

#include <algorithm>
#include <array>

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr int kIdleStartsUntilComplaint = 2;
constexpr milliseconds kCloseHalt{1000};
constexpr milliseconds kCloseRate{300};

}  // namespace

Session::Session(const SessionSettings& settings, const CoilMap& coils, std::span<const ToolDefinition> tools)
    : exchange_(settings.trace_capacity),
      setup_(settings.baud, coils, tools),
      poller_(settings.poller, coils) {}

void Session::attach(ByteChannel& channel) noexcept {
  exchange_.attach(channel);
  search_.begin(setup_.wanted_rate());
  setup_.new_channel();
  phase_ = Phase::kSearch;
}

Session::Event Session::run(MonotonicTime deadline, EmFrame& frame) noexcept {
  if (!exchange_.attached()) {
    return Event::kGone;
  }
  for (;;) {
    if (complaints_.take()) {
      return Event::kProblem;
    }
    if (phase_ == Phase::kTrack) {
      const Event event = track(deadline, frame);
      if (event != Event::kQuiet || exchange_.now() >= deadline) {
        return event;
      }
      continue;
    }
    if (!exchange_.pending() && exchange_.now() >= exchange_.rests_until()) {
      send_next();
    }
    Reply reply;
    const MonotonicTime until = exchange_.pending() ? deadline : std::min(deadline, exchange_.rests_until());
    switch (exchange_.listen(until, reply)) {
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
  if (!exchange_.attached() || complaints_.waiting()) {
    return {};
  }
  if (exchange_.pending()) {
    return exchange_.give_up_at();
  }
  return phase_ == Phase::kTrack ? poller_.due(exchange_) : exchange_.rests_until();
}

Session::Event Session::track(MonotonicTime deadline, EmFrame& frame) noexcept {
  switch (poller_.step(exchange_, deadline, frame)) {
    case Poller::Event::kQuiet:
      return Event::kQuiet;
    case Poller::Event::kMeasurement:
      idle_starts_ = 0;
      complaints_.over();
      return Event::kMeasurement;
    case Poller::Event::kRefused:
      return Event::kRefused;
    case Poller::Event::kPortsChanged:
      if (poller_.handles_contradict()) {
        complaints_.say(exchange_, contradiction());
      }
      set_up_after_halt(TrackerSetup::Step::kPorts);
      return Event::kQuiet;
    case Poller::Event::kNotTracking:
      if (++idle_starts_ >= kIdleStartsUntilComplaint) {
        complaints_.say(exchange_,
                        Problem("the tracker was started but measures nothing; switch it off and on"));
      }
      set_up_after_halt(TrackerSetup::Step::kInitialise);
      return Event::kQuiet;
    case Poller::Event::kStandstill: {
      Problem words("the tracker answers, but its frame counter stands still at ");
      words.hex(poller_.newest_number(), 8) << ": nothing new is measured; tracking is started again; if it "
                                               "stays, switch the tracker off and on";
      complaints_.say(exchange_, words);
      set_up_after_halt(TrackerSetup::Step::kInitialise);
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

void Session::set_up() noexcept {
  search_.forget();
  phase_ = Phase::kSetup;
}

void Session::set_up_after_halt(TrackerSetup::Step step) noexcept {
  set_up();
  setup_.begin_with_halt(exchange_, step);
}

void Session::search_again() noexcept {
  exchange_.trace().note(exchange_.now(), "the tracker has fallen silent");
  const auto rate = baud_rate(exchange_.baud());
  search_.begin_after_loss(rate && *rate != BaudRate::k9600 ? *rate : setup_.wanted_rate());
  phase_ = Phase::kSearch;
}

// It has forgotten everything and listens at 9600 baud.
void Session::was_reset() noexcept {
  ++counts_.resets;
  exchange_.trace().note(exchange_.now(), "the tracker has started anew");
  if (exchange_.baud() != bits_per_second(BaudRate::k9600)) {
    exchange_.set_baud(bits_per_second(BaudRate::k9600));
  }
  exchange_.abandon();
  set_up();
  setup_.begin();
}

void Session::send_next() noexcept {
  if (phase_ == Phase::kSearch) {
    search_.send(exchange_);
  } else {
    setup_.send(exchange_);
  }
}

void Session::take(const Reply* reply) noexcept {
  if (phase_ == Phase::kSearch) {
    take_search(reply);
    return;
  }
  switch (setup_.take(reply, exchange_, complaints_)) {
    case TrackerSetup::Result::kGoOn:
      break;
    case TrackerSetup::Result::kStarted:
      start_tracking();
      break;
    case TrackerSetup::Result::kSilent:
      search_again();
      break;
  }
}

void Session::take_search(const Reply* reply) noexcept {
  switch (search_.take(reply, exchange_.now())) {
    case TrackerSearch::Result::kGoOn:
      return;
    case TrackerSearch::Result::kNowhere:
      complaints_.say(exchange_, Problem("the tracker does not answer at any rate; check its power, its "
                                         "cable and that this is its port"));
      return;
    case TrackerSearch::Result::kFound:
      set_up();
      setup_.begin_initialised(exchange_);
      break;
    case TrackerSearch::Result::kOtherState:
      set_up_after_halt(TrackerSetup::Step::kInitialise);
      break;
    case TrackerSearch::Result::kUnchanged:
      ++counts_.resumptions;
      exchange_.trace().note(exchange_.now(), "it tracks the same coils as before");
      poller_.resume(exchange_.now());
      phase_ = Phase::kTrack;
      break;
  }
  ++counts_.links;
}

void Session::start_tracking() noexcept {
  std::array<TrackedHandle, kMaxTrackerCoils> tracked{};
  std::array<FoundCoil, kMaxTrackerCoils> coils_tracked{};
  std::size_t count = 0;
  for (const FoundCoil& coil : found()) {
    const auto index = coil.usable ? coils().coil_at(coil.plug) : std::nullopt;
    if (index && count < tracked.size()) {
      coils_tracked[count] = coil;
      tracked[count++] = {coil.handle, *index, coil.simulated};
    }
  }
  std::array<std::uint8_t, kMaxHandles> handles{};
  std::transform(found().begin(), found().end(), handles.begin(),
                 [](const FoundCoil& coil) { return coil.handle; });
  identity_ = setup_.questions().learnt();
  ++counts_.tracking_starts;
  exchange_.trace().note(exchange_.now(), "tracking");
  poller_.start(std::span(tracked).first(count), std::span(handles).first(found().size()), exchange_.now());
  phase_ = Phase::kTrack;
  search_.remember(std::span(coils_tracked).first(count),
                   baud_rate(exchange_.baud()).value_or(setup_.wanted_rate()));
}

SessionCounts Session::counts() const noexcept {
  SessionCounts counts = counts_;
  counts.port_setups = setup_.port_setups();
  return counts;
}

void Session::close() noexcept {
  search_.forget();
  if (!exchange_.attached()) {
    return;
  }
  exchange_.abandon();
  const bool found = phase_ != Phase::kSearch;
  const bool may_track =
      phase_ == Phase::kTrack || (phase_ == Phase::kSetup && (setup_.step() == TrackerSetup::Step::kStart ||
                                                              setup_.step() == TrackerSetup::Step::kHalt));
  if (may_track) {
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
