#include "drivers/aurora/tracker_setup.hpp"

#include <algorithm>

#include "drivers/aurora/error_codes.hpp"
#include "drivers/aurora/port_words.hpp"

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
constexpr milliseconds kRateSettles{100};       // clients wait 100 to 200 ms at both ends
constexpr milliseconds kNothingPluggedIn{500};  // until the ports are looked at again
constexpr milliseconds kAfterTrouble{500};
constexpr milliseconds kAfterInit{60};  // clients sleep 100 ms
constexpr int kDetoursUntilComplaint = 4;
constexpr std::uint8_t kNotInThisMode = 0x0C;

bool is_error(const Reply* reply) noexcept { return reply != nullptr && reply->kind == ReplyKind::kError; }

Problem describe_failure(std::string_view command, const Reply* reply) noexcept {
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

void TrackerSetup::new_channel() noexcept {
  rates_.forget();
  verifying_rate_ = false;
}

void TrackerSetup::begin() noexcept {
  verifying_rate_ = false;
  enter(Step::kInitialise);
}

void TrackerSetup::begin_with_halt(Exchange& exchange, Step step) noexcept {
  exchange.abandon();
  verifying_rate_ = false;
  after_halt_ = step;
  enter(Step::kHalt);
}

void TrackerSetup::begin_initialised(Exchange& exchange) noexcept {
  verifying_rate_ = false;
  exchange.rest(kAfterInit);
  choose_rate(exchange);
}

void TrackerSetup::enter(Step step) noexcept {
  step_ = step;
  attempts_ = 0;
  if (step == Step::kPorts) {
    ++port_setups_;
    ports_.begin();
  }
}

// An answer that was only late comes while nothing is asked.
bool TrackerSetup::retry(Exchange& exchange) noexcept {
  exchange.rest(kQuietAfterTrouble);
  return ++attempts_ < kAttempts;
}

void TrackerSetup::send(Exchange& exchange) noexcept {
  switch (step_) {
    case Step::kHalt:
      return exchange.send(tstop_command(), kHaltTimeout);
    case Step::kInitialise:
      return exchange.send(init_command(), kInitTimeout);
    case Step::kSetRate:
      return exchange.send(comm_command({.rate = rates_.best()}), kRateTimeout);
    case Step::kPorts:
      return exchange.send(ports_.command(), ports_.timeout());
    case Step::kIdentify:
      return exchange.send(questions_.command(), kIdentifyTimeout);
    case Step::kStart:
      return exchange.send(tstart_command(), kStartTimeout);
  }
}

TrackerSetup::Result TrackerSetup::take(const Reply* reply, Exchange& exchange,
                                        Complaints& complaints) noexcept {
  switch (step_) {
    case Step::kHalt:
      return take_halt(reply, exchange);
    case Step::kInitialise:
      return take_initialise(reply, exchange, complaints);
    case Step::kSetRate:
      return take_rate(reply, exchange);
    case Step::kPorts:
      return take_ports(reply, exchange, complaints);
    case Step::kIdentify:
      if (questions_.take(reply)) {
        enter(Step::kStart);
      }
      return Result::kGoOn;
    case Step::kStart:
      return take_start(reply, exchange, complaints);
  }
  return Result::kGoOn;
}

TrackerSetup::Result TrackerSetup::take_halt(const Reply* reply, Exchange& exchange) noexcept {
  if (reply != nullptr) {
    enter(after_halt_);
    return Result::kGoOn;
  }
  return retry(exchange) ? Result::kGoOn : Result::kSilent;
}

TrackerSetup::Result TrackerSetup::take_initialise(const Reply* reply, Exchange& exchange,
                                                   Complaints& complaints) noexcept {
  if (carried_out(reply)) {
    begin_initialised(exchange);
    return Result::kGoOn;
  }
  if (retry(exchange)) {
    return Result::kGoOn;
  }
  if (is_error(reply)) {
    complaints.say(exchange, describe_failure("INIT", reply));
    exchange.rest(kAfterTrouble);
  }
  return Result::kSilent;
}

void TrackerSetup::choose_rate(Exchange& exchange) noexcept {
  while (!exchange.knows_baud(bits_per_second(rates_.best()))) {
    rates_.refuse(rates_.best());
  }
  enter(bits_per_second(rates_.best()) == exchange.baud() ? Step::kPorts : Step::kSetRate);
}

TrackerSetup::Result TrackerSetup::take_rate(const Reply* reply, Exchange& exchange) noexcept {
  const BaudRate rate = rates_.best();
  if (carried_out(reply)) {
    if (!exchange.set_baud(bits_per_second(rate))) {
      return Result::kSilent;
    }
    exchange.rest(kRateSettles);
    verifying_rate_ = true;
    enter(Step::kPorts);
    return Result::kGoOn;
  }
  if (!is_error(reply)) {
    return Result::kSilent;  // it may have changed its rate, or not
  }
  if (!retry(exchange)) {
    rates_.refuse(rate);
    choose_rate(exchange);
  }
  return Result::kGoOn;
}

TrackerSetup::Result TrackerSetup::take_ports(const Reply* reply, Exchange& exchange,
                                              Complaints& complaints) noexcept {
  ports_.take(reply);
  verifying_rate_ = verifying_rate_ && reply == nullptr;
  switch (ports_.state()) {
    case PortSetup::State::kBusy:
      break;
    case PortSetup::State::kDone:
      ports_done(exchange, complaints);
      break;
    case PortSetup::State::kMustHalt:
      out_of_order(Step::kPorts, exchange, complaints);
      break;
    case PortSetup::State::kMustInit:
      out_of_order(Step::kInitialise, exchange, complaints);
      break;
    case PortSetup::State::kNoAnswer:
      if (verifying_rate_) {
        rates_.refuse(rates_.best());
      }
      verifying_rate_ = false;
      return Result::kSilent;
  }
  return Result::kGoOn;
}

void TrackerSetup::out_of_order(Step step, Exchange& exchange, Complaints& complaints) noexcept {
  if (++detours_ >= kDetoursUntilComplaint) {
    complaints.say(exchange, Problem("the tracker does not leave its mode; switch it off and on"));
    exchange.rest(kAfterTrouble);
  }
  begin_with_halt(exchange, step);
}

// Who it is is asked behind the ports: at 9600 baud the answers took 0.6 s of every start.
void TrackerSetup::ports_done(Exchange& exchange, Complaints& complaints) noexcept {
  detours_ = 0;
  const bool any = std::any_of(ports_.found().begin(), ports_.found().end(), [this](const FoundCoil& coil) {
    return coil.usable && ports_.coils().coil_at(coil.plug).has_value();
  });
  questions_.take_tools(ports_);
  const Problem words = describe_missing(ports_.coils(), ports_.found(), {});
  if (!words.empty() && !(words == last_missing_)) {
    complaints.say(exchange, words);
  }
  last_missing_ = words;
  if (any && !questions_.asked()) {
    questions_.begin();
    enter(Step::kIdentify);
  } else if (any) {
    enter(Step::kStart);
  } else {
    exchange.rest(kNothingPluggedIn);
    enter(Step::kPorts);
  }
}

TrackerSetup::Result TrackerSetup::take_start(const Reply* reply, Exchange& exchange,
                                              Complaints& complaints) noexcept {
  if (carried_out(reply)) {
    return Result::kStarted;
  }
  if (is_error(reply) && reply->error_code == kNotInThisMode) {
    begin_with_halt(exchange, Step::kPorts);
    return Result::kGoOn;
  }
  if (retry(exchange)) {
    return Result::kGoOn;
  }
  if (!is_error(reply)) {
    return Result::kSilent;
  }
  complaints.say(exchange, describe_failure("TSTART", reply));
  exchange.rest(kAfterTrouble);
  begin_with_halt(exchange, Step::kInitialise);
  return Result::kGoOn;
}

}  // namespace tubed::aurora
