#include "tests/second_aurora/second_aurora.hpp"

#include <algorithm>
#include <stdexcept>

namespace tubed::second_aurora {

namespace {

constexpr std::size_t kMaxPorts = 8;

void check(const Tool& tool) {
  if (tool.coils < 1 || tool.coils > 2) {
    throw std::invalid_argument("a plug of the second Aurora has 1 or 2 coils, not " +
                                std::to_string(tool.coils));
  }
}

Settings checked_settings(const Settings& settings) {
  if (settings.ports.empty() || settings.ports.size() > kMaxPorts) {
    throw std::invalid_argument("the second Aurora has 1 to 8 ports, not " +
                                std::to_string(settings.ports.size()));
  }
  for (const auto& tool : settings.ports) {
    if (tool) {
      check(*tool);
    }
  }
  if (!(settings.timing.measurements_per_second > 0 && settings.timing.measurements_per_second < 1000)) {
    throw std::invalid_argument("measurements_per_second of the second Aurora lies between 0 and 1000");
  }
  return settings;
}

std::int64_t duration_or(const Fault& fault, std::int64_t otherwise_ns) {
  return fault.duration_ns > 0 ? fault.duration_ns : otherwise_ns;
}

}  // namespace

SecondAurora::SecondAurora(const Settings& settings, Motion motion, std::int64_t power_on_ns)
    : settings_(checked_settings(settings)),
      mischief_(settings_.faults, settings_.seed),
      field_(settings_, std::move(motion), mischief_),
      interpreter_(settings_, field_, mischief_),
      device_ear_(mischief_),
      host_ear_(mischief_),
      out_(settings_.timing.latency_timer_ns),
      power_until_ns_(power_on_ns),
      first_frame_(settings_.first_frame) {}

void SecondAurora::hear(std::span<const std::uint8_t> bytes, int host_baud, std::int64_t now_ns) {
  advance(now_ns);
  if (connected(now_ns)) {
    in_.send(bytes, host_baud, now_ns);
  }
}

void SecondAurora::serial_break(std::int64_t now_ns) {
  advance(now_ns);
  in_.cut(now_ns);
  if (power_ != Power::Off && !hung_up(now_ns)) {
    reset(now_ns);
  }
}

void SecondAurora::speak(std::int64_t now_ns, int host_baud, std::vector<std::uint8_t>& out) {
  advance(now_ns);
  for (; !out_.empty() && out_.front().handed_over_ns <= now_ns; out_.pop()) {
    if (!hung_up(out_.front().handed_over_ns)) {
      host_ear_.hear(out_.front().byte, out_.front().baud, host_baud, out);
    }
  }
}

std::int64_t SecondAurora::next_event_ns() const {
  std::int64_t next_ns = std::min({in_.next_line_ns(baud_), next_baud_at_ns_, hung_until_ns_});
  if (power_ != Power::On) {
    next_ns = std::min(next_ns, power_until_ns_);
  }
  if (work_) {
    next_ns = std::min(next_ns, work_->done_ns);
  }
  return out_.empty() ? next_ns : std::min(next_ns, out_.front().handed_over_ns);
}

bool SecondAurora::connected(std::int64_t now_ns) const {
  const bool dark = power_ == Power::Off && now_ns < power_until_ns_;
  return !hung_up(now_ns) && !(dark && settings_.port_vanishes_without_power);
}

void SecondAurora::hang_up(std::int64_t now_ns, std::int64_t duration_ns) {
  advance(now_ns);
  hung_from_ns_ = now_ns;
  hung_until_ns_ = now_ns + duration_ns;
}

void SecondAurora::power_cycle(std::int64_t now_ns, std::int64_t off_duration_ns) {
  advance(now_ns);
  switch_off(now_ns, off_duration_ns);
}

void SecondAurora::check_port(int port) const {
  if (port < 1 || static_cast<std::size_t>(port) > settings_.ports.size()) {
    throw std::invalid_argument("the second Aurora has no port " + std::to_string(port));
  }
}

void SecondAurora::plug(int port, const Tool& tool, std::int64_t now_ns) {
  advance(now_ns);
  check_port(port);
  check(tool);
  if (interpreter_.ports().occupied(port)) {
    interpreter_.unplug(port);
  }
  interpreter_.plug(port, tool);
}

void SecondAurora::unplug(int port, std::int64_t now_ns) {
  advance(now_ns);
  check_port(port);
  if (interpreter_.ports().occupied(port)) {
    interpreter_.unplug(port);
  }
}

void SecondAurora::unplug_field_generator(std::int64_t now_ns) {
  advance(now_ns);
  field_.unplug_generator();
}

void SecondAurora::plug_field_generator(std::int64_t now_ns) {
  advance(now_ns);
  field_.plug_generator();
}

void SecondAurora::raise_system_status(std::uint16_t bits, std::int64_t now_ns) {
  advance(now_ns);
  interpreter_.raise_status(bits);
}

void SecondAurora::clear_system_status(std::uint16_t bits, std::int64_t now_ns) {
  advance(now_ns);
  interpreter_.clear_status(bits);
}

void SecondAurora::strike(const Fault& fault, std::int64_t now_ns) {
  advance(now_ns);
  mischief_.add(fault);
}

void SecondAurora::strike_no_more(std::int64_t now_ns) {
  advance(now_ns);
  mischief_.clear();
}

Counts SecondAurora::counts() const {
  Counts counts = counts_;
  counts.struck = mischief_.struck();
  counts.measurements = field_.count();
  return counts;
}

void SecondAurora::advance(std::int64_t now_ns) {
  for (std::int64_t next_ns = next_step_ns(); next_ns <= now_ns; next_ns = next_step_ns()) {
    step(next_ns);
  }
}

std::int64_t SecondAurora::next_step_ns() const {
  std::int64_t next_ns = std::min(next_baud_at_ns_, hung_until_ns_);
  next_ns = std::min(next_ns, power_ == Power::On ? field_.next_measurement_ns() : power_until_ns_);
  if (work_) {
    next_ns = std::min(next_ns, work_->done_ns);
  }
  return in_.empty() ? next_ns : std::min(next_ns, in_.front().time_ns);
}

// Does one thing that is due at `now_ns`; what is measured comes before what reports it.
void SecondAurora::step(std::int64_t now_ns) {
  if (power_ != Power::On && power_until_ns_ <= now_ns) {
    power_step(now_ns);
  } else if (power_ == Power::On && field_.next_measurement_ns() <= now_ns) {
    const Truth* truth = field_.measure(interpreter_.ports(), interpreter_.tracking());
    if (truth != nullptr && on_measurement) {
      on_measurement(*truth);
    }
  } else if (next_baud_at_ns_ <= now_ns) {
    baud_ = next_baud_;
    next_baud_at_ns_ = INT64_MAX;
  } else if (hung_until_ns_ <= now_ns) {
    out_.lose(hung_from_ns_, hung_until_ns_);
    hung_from_ns_ = hung_until_ns_ = INT64_MAX;
  } else if (work_ && work_->done_ns <= now_ns) {
    finish_work();
  } else {
    byte_arrives();
  }
}

void SecondAurora::power_step(std::int64_t now_ns) {
  if (power_ == Power::Off) {
    power_ = Power::Resetting;
    power_until_ns_ = now_ns + settings_.timing.boot_ns;
    return;
  }
  power_ = Power::On;
  busy_until_ns_ = now_ns;
  field_.start(now_ns, first_frame_);
  first_frame_ = 8;
  out_.send(framed("RESET"), baud_, now_ns);
}

void SecondAurora::byte_arrives() {
  const LineIn::Arrival arrival = in_.front();
  in_.pop();
  if (power_ != Power::On || hung_up(arrival.time_ns)) {
    return;
  }
  Bytes heard;
  device_ear_.hear(arrival.byte, arrival.host_baud, baud_, heard);
  for (const std::uint8_t byte : heard) {
    if (byte != '\r') {
      // One more than allowed is enough to be too long.
      if (line_.size() <= kLongestLine) {
        line_ += static_cast<char>(byte);
      }
      continue;
    }
    waiting_.emplace_back(read_command(line_), arrival.time_ns);
    line_.clear();
  }
  start_work();
}

void SecondAurora::start_work() {
  if (work_ || waiting_.empty()) {
    return;
  }
  std::int64_t start_ns = std::max(waiting_.front().second, busy_until_ns_);
  if (!settings_.firmware.works_ahead_while_sending) {
    start_ns = std::max(start_ns, out_.free_at_ns());
  }
  const CommandLine& command = waiting_.front().first;
  work_ = Work{command, start_ns + interpreter_.duration_ns(command)};
  waiting_.pop_front();
}

void SecondAurora::finish_work() {
  const Work work = *work_;
  work_.reset();
  const std::int64_t now_ns = work.done_ns;
  busy_until_ns_ = now_ns;
  ++counts_.commands;
  Answer answer = interpreter_.answer(work.command, now_ns);
  if (answer.resets) {
    return reset(now_ns);
  }
  Bytes& previous = answer.kind.binary ? previous_binary_ : previous_text_;
  answer.kind.has_previous = answer.kind.tracking && !previous.empty();
  const std::optional<Fault> fault = mischief_.on_reply(answer.kind);
  if (fault && fault->kind == FaultKind::TextForBinary) {
    answer.bytes = interpreter_.answer_in_text(work.command, now_ns).bytes;
  }
  if (answer.rate != 0) {
    next_baud_ = answer.rate;
  }
  counts_.tracking_replies += answer.kind.tracking ? 1 : 0;
  const bool is_error =
      answer.bytes.size() > 5 && std::equal(answer.bytes.begin(), answer.bytes.begin() + 5, "ERROR");
  counts_.errors += is_error ? 1 : 0;
  send_reply(fault && fault->kind == FaultKind::Stale ? previous : answer.bytes, fault, now_ns);
  if (answer.rate != 0 && power_ == Power::On) {
    next_baud_at_ns_ = std::max(out_.free_at_ns(), now_ns) + settings_.timing.comm_switch_ns;
    busy_until_ns_ = next_baud_at_ns_;
  }
  if (answer.kind.tracking && !fault) {
    previous = answer.bytes;
  }
  start_work();
}

void SecondAurora::send_reply(const Bytes& reply, const std::optional<Fault>& fault, std::int64_t now_ns) {
  ++counts_.replies;
  if (!fault) {
    return out_.send(reply, baud_, now_ns);
  }
  switch (fault->kind) {
    case FaultKind::SpontaneousReset:
      return reset(now_ns);
    case FaultKind::HangUp:
      hung_from_ns_ = now_ns;
      hung_until_ns_ = now_ns + duration_or(*fault, 3 * kSecond_ns);
      return;
    case FaultKind::PowerCycle:
      return switch_off(now_ns, duration_or(*fault, 5 * kSecond_ns));
    case FaultKind::Late:
      return out_.send(reply, baud_, now_ns + duration_or(*fault, 150 * kMillisecond_ns));
    case FaultKind::PauseInside: {
      const std::size_t first = 1 + mischief_.below(reply.size() - 1);
      out_.send(std::span(reply).first(first), baud_, now_ns);
      const std::int64_t go_on_ns = out_.free_at_ns() + duration_or(*fault, 60 * kMillisecond_ns);
      return out_.send(std::span(reply).subspan(first), baud_, go_on_ns);
    }
    default:
      return out_.send(mischief_.damaged(*fault, reply), baud_, now_ns);
  }
}

void SecondAurora::forget_everything(std::int64_t now_ns) {
  out_.cut(now_ns);
  line_.clear();
  waiting_.clear();
  work_.reset();
  baud_ = 9600;
  next_baud_at_ns_ = INT64_MAX;
  previous_text_.clear();
  previous_binary_.clear();
  interpreter_.reset();
}

void SecondAurora::reset(std::int64_t now_ns) {
  ++counts_.resets;
  forget_everything(now_ns);
  power_ = Power::Resetting;
  power_until_ns_ = now_ns + settings_.timing.reset_ns;
}

void SecondAurora::switch_off(std::int64_t now_ns, std::int64_t duration_ns) {
  ++counts_.resets;
  forget_everything(now_ns);
  power_ = Power::Off;
  power_until_ns_ = now_ns + duration_ns;
}

}  // namespace tubed::second_aurora
