// From the first answer of a tracker to its first measurement: what every reply on the way leads to.
#include <algorithm>
#include <array>

#include "drivers/aurora/error_codes.hpp"
#include "drivers/aurora/session.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kRateSettles{100};       // clients wait 100 to 200 ms at both ends
constexpr milliseconds kNothingPluggedIn{500};  // until the ports are looked at again
constexpr milliseconds kAfterTrouble{500};
constexpr milliseconds kAfterInit{60};  // clients sleep 100 ms
constexpr int kDetoursUntilComplaint = 4;
constexpr std::uint8_t kNotInThisMode = 0x0C;

/// Items of VER, Sec. "VER" of the guide: firmware, field generator, units.
constexpr std::array<int, 3> kVersions = {4, 7, 8};

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
  if (carried_out(reply)) {
    initialised();
    return;
  }
  if (retry()) {
    return;
  }
  if (is_error(reply)) {
    complain(describe_failure("INIT", reply));
    wait_until_ = exchange_.now() + kAfterTrouble;
  }
  search_again();
}

void Session::initialised() noexcept {
  wait_until_ = exchange_.now() + kAfterInit;
  set_rate();
}

CommandLine Session::identity_question() const noexcept {
  return question_ == 0 ? apirev_command() : ver_command(kVersions[question_ - 1]);
}

// Nothing depends on it, so that a tracker that does not say is no trouble. Asked behind the ports: at 9600
// baud the answers took 0.6 s of every start.
void Session::take_identify(const Reply* reply) noexcept {
  const std::string_view said =
      reply != nullptr && reply->kind == ReplyKind::kText ? reply->text() : std::string_view();
  const auto note = [](auto& kept, std::optional<std::string_view> found) {
    if (found && !found->empty()) {
      kept = {};
      kept.printable(*found);
    }
  };
  switch (question_) {
    case 0:
      api_revision_ = parse_api_revision(said);
      note(learnt_.api_revision, said);
      break;
    case 1:
      note(learnt_.firmware, find_firmware(said));
      break;
    case 2:
      note(learnt_.field_generator, find_serial_number(said));
      break;
    default:
      note(learnt_.control_unit_serial, find_serial_number(said));
  }
  if (++question_ <= kVersions.size()) {
    return;
  }
  identified_ = true;
  enter(Phase::kStart);
}

void Session::set_rate() noexcept {
  while (!exchange_.knows_baud(bits_per_second(rates_.best()))) {
    rates_.refuse(rates_.best());
  }
  enter(bits_per_second(rates_.best()) == exchange_.baud() ? Phase::kPorts : Phase::kSetRate);
}

void Session::take_rate(const Reply* reply) noexcept {
  const BaudRate rate = rates_.best();
  if (carried_out(reply)) {
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
    rates_.refuse(rate);
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
        rates_.refuse(rates_.best());
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

void Session::identify_tools() noexcept {
  if (!ports_.control_unit_serial().empty()) {
    learnt_.control_unit_serial = {};
    learnt_.control_unit_serial.printable(ports_.control_unit_serial());
  }
  learnt_.tool_count = 0;
  for (const FoundCoil& coil : ports_.found()) {
    const auto tools = std::span(learnt_.tools).first(static_cast<std::size_t>(learnt_.tool_count));
    const bool known = std::any_of(tools.begin(), tools.end(),
                                   [&](const ToolIdentity& tool) { return tool.port == coil.plug.port; });
    if (coil.serial_number != 0 && !known && learnt_.tool_count < kMaxTrackerCoils) {
      learnt_.tools[static_cast<std::size_t>(learnt_.tool_count++)] = {coil.plug.port, coil.serial_number,
                                                                       coil.part_number};
    }
  }
}

void Session::ports_done() noexcept {
  detours_ = 0;
  const bool any = std::any_of(ports_.found().begin(), ports_.found().end(), [this](const FoundCoil& coil) {
    return coil.usable && coils_.coil_at(coil.plug).has_value();
  });
  identify_tools();
  const Problem words = missing();
  if (!words.empty() && !(words == last_missing_)) {
    complain(words);
  }
  last_missing_ = words;
  if (any && !identified_) {
    question_ = 0;
    enter(Phase::kIdentify);
  } else if (any) {
    enter(Phase::kStart);
  } else {
    wait_until_ = exchange_.now() + kNothingPluggedIn;
    enter(Phase::kPorts);
  }
}

void Session::take_start(const Reply* reply) noexcept {
  if (carried_out(reply)) {
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
    complain(describe_failure("TSTART", reply));
    wait_until_ = exchange_.now() + kAfterTrouble;
    halt_then(Phase::kInitialise);
    return;
  }
  search_again();
}

void Session::start_tracking() noexcept {
  std::array<TrackedHandle, kMaxTrackerCoils> tracked{};
  std::array<FoundCoil, kMaxTrackerCoils> coils{};
  std::size_t count = 0;
  for (const FoundCoil& coil : ports_.found()) {
    const auto index = coil.usable ? coils_.coil_at(coil.plug) : std::nullopt;
    if (index && count < tracked.size()) {
      coils[count] = coil;
      tracked[count++] = {coil.handle, *index, coil.simulated};
    }
  }
  std::array<std::uint8_t, kMaxHandles> found{};
  std::transform(ports_.found().begin(), ports_.found().end(), found.begin(),
                 [](const FoundCoil& coil) { return coil.handle; });
  identity_ = learnt_;
  ++counts_.tracking_starts;
  exchange_.trace().note(exchange_.now(), "tracking");
  tracking_rate_ = baud_rate(exchange_.baud()).value_or(rates_.wanted());
  poller_.start(std::span(tracked).first(count), std::span(found).first(ports_.found().size()),
                exchange_.now());
  enter(Phase::kTrack);
  resumption_.remember(std::span(coils).first(count));
}

}  // namespace tubed::aurora
