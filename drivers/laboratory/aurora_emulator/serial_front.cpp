#include "drivers/laboratory/aurora_emulator/serial_front.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/laboratory/aurora_emulator/control.hpp"

namespace tubed::aurora::emulator {

namespace {

using std::chrono::milliseconds;

/// Bytes are handed over in portions, as a USB adapter set to low latency does.
constexpr auto kPortion = milliseconds(1);
constexpr auto kMaxSleep = milliseconds(50);
/// How soon an opened port or the end of a hang-up is noticed.
constexpr auto kGlance = milliseconds(2);

timespec time_left(std::chrono::nanoseconds left) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  const std::int64_t ns = std::max<std::int64_t>(left.count(), 0);
  return {static_cast<time_t>(ns / kNsPerSecond), static_cast<long>(ns % kNsPerSecond)};
}

}  // namespace

SerialFront::SerialFront(Device& device, std::filesystem::path link, const std::filesystem::path& control)
    : device_(device), link_(std::move(link)) {
  if (!control.empty()) {
    control_ = std::make_unique<ControlSocket>(control);
  }
  terminal_ = std::make_unique<PseudoTerminal>(link_);
}

std::string SerialFront::step() {
  wait(monotonic_now());
  std::string complaint;
  while (control_ && control_->take([&](const std::string& command) {
    const std::string why = apply_control(command, device_, monotonic_now());
    complaint = why.empty() ? complaint : "'" + command + "': " + why;
    return why;
  })) {
  }
  const MonotonicTime now = monotonic_now();
  if (!device_.connected(now)) {
    terminal_.reset();
  } else if (!terminal_) {
    terminal_ = std::make_unique<PseudoTerminal>(link_);
  }
  exchange_bytes(now);
  return complaint;
}

void SerialFront::wait(MonotonicTime now) const {
  const bool in_use = terminal_ && terminal_->in_use();
  MonotonicTime until = now + (in_use && device_.connected(now) ? kMaxSleep : kGlance);
  if (const MonotonicTime event = device_.next_event(); event < until) {
    until = std::max(event, now + kPortion);
  }
  // A terminal that nobody has opened would end the sleep at once, again and again.
  std::array<pollfd, 2> descriptors = {pollfd{in_use ? terminal_->descriptor() : -1, POLLIN, 0},
                                       pollfd{control_ ? control_->descriptor() : -1, POLLIN, 0}};
  const timespec left = time_left(until - monotonic_now());
  ::ppoll(descriptors.data(), descriptors.size(), &left, nullptr);
}

void SerialFront::exchange_bytes(MonotonicTime now) {
  const int rate = terminal_ ? terminal_->bits_per_second() : 0;
  incoming_.clear();
  outgoing_.clear();
  if (terminal_) {
    terminal_->read(incoming_);
  }
  if (!incoming_.empty()) {
    device_.receive(incoming_, rate, now);
  }
  device_.transmit(now, rate, outgoing_);
  if (terminal_ && terminal_->in_use()) {
    terminal_->write(outgoing_);
  }
}

}  // namespace tubed::aurora::emulator
