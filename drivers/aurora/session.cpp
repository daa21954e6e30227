#include "drivers/aurora/session.hpp"

#include <algorithm>

#include "drivers/aurora/error_codes.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr int kAttempts = 3;
constexpr milliseconds kInitTimeout{5000};   // 50 ms recorded
constexpr milliseconds kHaltTimeout{2000};   // 0.36 s recorded
constexpr milliseconds kStartTimeout{6000};  // 2.0 s recorded
constexpr milliseconds kRateTimeout{1000};
constexpr milliseconds kIdentifyTimeout{500};
constexpr milliseconds kRateSettles{100};       // clients wait 100 to 200 ms at both ends
constexpr milliseconds kNothingPluggedIn{500};  // until the ports are looked at again
constexpr milliseconds kAfterTrouble{500};
constexpr milliseconds kQuietAfterTrouble{30};
constexpr milliseconds kAfterInit{60};  // clients sleep 100 ms
constexpr int kDetoursUntilComplaint = 4;
constexpr int kIdleStartsUntilComplaint = 2;
constexpr milliseconds kCloseHalt{1000};
constexpr milliseconds kCloseRate{300};
constexpr std::uint8_t kNotInThisMode = 0x0C;
constexpr int kFreezeTagVersion = 4;

bool okay(const Reply* reply) noexcept {
  return reply != nullptr && (reply->kind == ReplyKind::kOkay || reply->kind == ReplyKind::kWarning);
}
bool is_error(const Reply* reply) noexcept { return reply != nullptr && reply->kind == ReplyKind::kError; }

std::size_t place_of(BaudRate rate) noexcept {
  return static_cast<std::size_t>(std::find(kRates.begin(), kRates.end(), rate) - kRates.begin());
}

Problem describe(std::string_view command, const Reply* reply) noexcept {
  Problem words(command);
  if (!is_error(reply)) {
    return words << " was not answered; check cable and power";
  }
  const ErrorDescription error = describe_error(reply->error_code);
  words << " failed with ERROR";
  words.hex(reply->error_code) << ", " << error.meaning;
  return words << "; " << remedy_text(error.remedy);
}

}  // namespace

Session::Session(const SessionSettings& settings, const CoilMap& coils, std::span<const ToolDefinition> tools)
    : settings_(settings),
      coils_(coils),
      exchange_(settings.trace_capacity),
      ports_(coils, tools),
      poller_(settings.poller, coils) {}

void Session::attach(ByteChannel& channel) noexcept {
  exchange_.attach(channel);
  search_.begin(settings_.baud);
  refused_rates_ = 0;
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

Session::Event Session::track(MonotonicTime deadline, EmFrame& frame) noexcept {
  switch (poller_.step(exchange_, deadline, frame)) {
    case Poller::Event::kQuiet:
      return Event::kQuiet;
    case Poller::Event::kMeasurement:
      idle_starts_ = 0;
      return Event::kMeasurement;
    case Poller::Event::kRefused:
      return Event::kRefused;
    case Poller::Event::kPortsChanged:
      halt_then(Phase::kPorts);
      return Event::kQuiet;
    case Poller::Event::kNotTracking:
      if (++idle_starts_ >= kIdleStartsUntilComplaint) {
        complain(Problem("the tracker was started but measures nothing; switch it off and on"));
      }
      halt_then(Phase::kInitialise);
      return Event::kQuiet;
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
  search_.begin_after_loss(rate && *rate != BaudRate::k9600 ? *rate : settings_.baud);
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
  problem_ = problem;
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
      send(asking_version_ ? ver_command(kFreezeTagVersion) : apirev_command(), kIdentifyTimeout);
      break;
    case Phase::kSetRate:
      send(comm_command({.rate = rate_to_ask_for()}), kRateTimeout);
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
    search_step_ends_ = exchange_.now() + step.patience;
  }
  send(init_command(), LinkSearch::kBetweenTries);
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
  if (reply != nullptr) {
    ++counts_.links;
    verifying_rate_ = false;
    if (okay(reply)) {
      initialised();
    } else {
      halt_then(Phase::kInitialise);
    }
    return;
  }
  if (exchange_.now() < search_step_ends_) {
    return;
  }
  search_step_begun_ = false;
  if (!search_.advance()) {
    complain(Problem(
        "the tracker does not answer at any rate; check its power, its cable and that this is its port"));
  }
}

void Session::take_halt(const Reply* reply) noexcept {
  if (reply == nullptr && retry()) {
    return;
  }
  if (reply == nullptr) {
    search_again();
    return;
  }
  enter(after_halt_);
}

void Session::take_initialise(const Reply* reply) noexcept {
  if (okay(reply)) {
    initialised();
    return;
  }
  if (retry()) {
    return;
  }
  if (is_error(reply)) {
    complain(describe("INIT", reply));
    wait_until_ = exchange_.now() + kAfterTrouble;
  }
  search_again();
}

void Session::initialised() noexcept {
  wait_until_ = exchange_.now() + kAfterInit;
  if (identified_) {
    set_rate();
  } else {
    asking_version_ = false;
    enter(Phase::kIdentify);
  }
}

// Nothing depends on it, so that a tracker that does not say is no trouble.
void Session::take_identify(const Reply* reply) noexcept {
  const bool text = reply != nullptr && reply->kind == ReplyKind::kText;
  if (!asking_version_) {
    api_revision_ = text ? parse_api_revision(reply->text()) : std::nullopt;
    asking_version_ = true;
    return;
  }
  if (const auto firmware = text ? find_firmware(reply->text()) : std::nullopt) {
    firmware_ = Words<48>(*firmware);
  }
  identified_ = true;
  set_rate();
}

void Session::set_rate() noexcept {
  while (!exchange_.knows_baud(bits_per_second(rate_to_ask_for()))) {
    refused_rates_ |= 1U << place_of(rate_to_ask_for());
  }
  enter(bits_per_second(rate_to_ask_for()) == exchange_.baud() ? Phase::kPorts : Phase::kSetRate);
}

// The fastest that is not faster than asked for and that neither the tracker nor the host have refused.
BaudRate Session::rate_to_ask_for() const noexcept {
  const int most = bits_per_second(settings_.baud);
  for (std::size_t i = 0; i < kRates.size(); ++i) {
    if (bits_per_second(kRates[i]) <= most && (refused_rates_ >> i & 1U) == 0) {
      return kRates[i];
    }
  }
  return BaudRate::k9600;
}

void Session::take_rate(const Reply* reply) noexcept {
  const BaudRate rate = rate_to_ask_for();
  if (okay(reply)) {
    if (!exchange_.set_baud(bits_per_second(rate))) {
      search_again();
      return;
    }
    wait_until_ = exchange_.now() + kRateSettles;
    verifying_rate_ = true;
    enter(Phase::kPorts);
  } else if (is_error(reply)) {
    if (retry()) {
      return;
    }
    refused_rates_ |= 1U << place_of(rate);
    set_rate();
  } else {
    search_again();  // it may have changed its rate, or not
  }
}

void Session::take_ports(const Reply* reply) noexcept {
  ports_.take(reply);
  verifying_rate_ = verifying_rate_ && reply == nullptr;
  switch (ports_.state()) {
    case PortSetup::State::kBusy:
      break;
    case PortSetup::State::kDone:
      ports_done();
      break;
    case PortSetup::State::kMustHalt:
      out_of_order(Phase::kPorts);
      break;
    case PortSetup::State::kMustInit:
      out_of_order(Phase::kInitialise);
      break;
    case PortSetup::State::kNoAnswer:
      if (verifying_rate_) {
        refused_rates_ |= 1U << place_of(rate_to_ask_for());
      }
      verifying_rate_ = false;
      search_again();
      break;
  }
}

void Session::out_of_order(Phase phase) noexcept {
  if (++detours_ >= kDetoursUntilComplaint) {
    complain(Problem("the tracker does not leave its mode; switch it off and on"));
    wait_until_ = exchange_.now() + kAfterTrouble;
  }
  halt_then(phase);
}

void Session::ports_done() noexcept {
  detours_ = 0;
  std::array<CoilPlug, kMaxHandles> usable{};
  std::size_t count = 0;
  bool any = false;
  for (const FoundCoil& coil : ports_.found()) {
    if (coil.usable) {
      usable[count++] = coil.plug;
      any |= coils_.coil_at(coil.plug).has_value();
    }
  }
  Problem missing = describe_missing(coils_, std::span(usable).first(count));
  for (const FoundCoil& coil : ports_.found()) {
    if (!coil.usable && coil.error_code != 0) {
      (missing << "; port " << coil.plug.port << ": ERROR").hex(coil.error_code);
    }
  }
  if (!missing.empty() && !(missing == last_missing_)) {
    complain(missing);
  }
  last_missing_ = missing;
  if (any) {
    enter(Phase::kStart);
  } else {
    wait_until_ = exchange_.now() + kNothingPluggedIn;
    enter(Phase::kPorts);
  }
}

void Session::take_start(const Reply* reply) noexcept {
  if (okay(reply)) {
    start_tracking();
    return;
  }
  if (is_error(reply) && reply->error_code == kNotInThisMode) {
    halt_then(Phase::kPorts);
    return;
  }
  if (retry()) {
    return;
  }
  if (is_error(reply)) {
    complain(describe("TSTART", reply));
    wait_until_ = exchange_.now() + kAfterTrouble;
    halt_then(Phase::kInitialise);
    return;
  }
  search_again();
}

void Session::start_tracking() noexcept {
  std::array<TrackedHandle, kMaxTrackerCoils> tracked{};
  std::size_t count = 0;
  for (const FoundCoil& coil : ports_.found()) {
    const auto index = coil.usable ? coils_.coil_at(coil.plug) : std::nullopt;
    if (index && count < tracked.size()) {
      tracked[count++] = {coil.handle, *index, coil.simulated};
    }
  }
  ++counts_.tracking_starts;
  exchange_.trace().note(exchange_.now(), "tracking");
  poller_.start(std::span(tracked).first(count), exchange_.now());
  enter(Phase::kTrack);
}

void Session::close() noexcept {
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
    if (event == Exchange::Event::kReply && (okay(&reply) || is_error(&reply))) {
      return okay(&reply);
    }
    if (event != Exchange::Event::kReply || exchange_.now() >= deadline) {
      return false;
    }
  }
}

}  // namespace tubed::aurora
