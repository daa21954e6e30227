#include "drivers/laboratory/aurora_emulator/control.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

namespace tubed::aurora::emulator {

namespace {

constexpr std::chrono::nanoseconds kForEver = std::chrono::nanoseconds::max();
constexpr double kMax_s = 1e6;
constexpr int kMaxJump = 1'000'000;
constexpr std::size_t kPartNumberSize = 20;
constexpr std::uint16_t kHardwareChanged = 1U << 10;

/// Bits of the system status by the names that `status` takes.
constexpr std::array kConditions = {
    std::pair<std::string_view, std::uint16_t>{"synchronisation", 1U << 0},
    std::pair<std::string_view, std::uint16_t>{"diagnostic", 1U << 8},
    std::pair<std::string_view, std::uint16_t>{"temperature", 1U << 9},
    std::pair<std::string_view, std::uint16_t>{"hardware-changed", kHardwareChanged},
};

/// Words of a command, taken one after the other; the first that is wrong is remembered.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}

  std::string_view take() {
    constexpr std::string_view kBlanks = " \t\r\n";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kBlanks), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kBlanks));
    rest_.remove_prefix(word.size());
    return word;
  }

  double number(std::string_view word, double least, double greatest) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    // A comparison with NaN is false.
    if (error != std::errc{} || end != word.data() + word.size() || !(value >= least && value <= greatest)) {
      fail("'" + std::string(word) + "' is no number from " + text(least) + " to " + text(greatest));
      return least;
    }
    return value;
  }
  double number(double least, double greatest) { return number(take(), least, greatest); }

  int whole(int least, int greatest) {
    const double value = number(least, greatest);
    if (value != std::floor(value)) {
      fail("a whole number is wanted");
    }
    return static_cast<int>(value);
  }

  std::chrono::nanoseconds seconds() {
    return std::chrono::nanoseconds(std::llround(1e9 * number(0, kMax_s)));
  }

  void end() {
    if (const std::string_view word = take(); !word.empty()) {
      fail("'" + std::string(word) + "' is one word too many");
    }
  }

  void fail(const std::string& why) { why_ = why_.empty() ? why : why_; }
  [[nodiscard]] bool good() const { return why_.empty(); }
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  static std::string text(double value) {
    std::string digits = std::to_string(static_cast<long long>(value));
    return digits;
  }

  std::string_view rest_;
  std::string why_;
};

void set_fault(Words& words, Device& device) {
  const std::string_view name = words.take();
  const auto fault = find_fault(name);
  if (!fault) {
    words.fail("there is no fault '" + std::string(name) + "'");
    return;
  }
  FaultRule rule;
  const std::string_view how = words.take();
  if (how == "next") {
    rule.next = static_cast<std::uint64_t>(words.whole(1, std::numeric_limits<int>::max()));
  } else if (how != "off") {
    rule.probability = words.number(how, 0, 1);
  }
  if (const std::string_view scope = words.take(); scope == "any") {
    rule.scope = Scope::kAny;
  } else if (!scope.empty()) {
    words.fail("'" + std::string(scope) + "' is neither nothing nor 'any'");
  }
  words.end();
  if (words.good()) {
    device.faults().set(*fault, rule);
  }
}

void set_amount(Words& words, Device& device) {
  const std::string_view name = words.take();
  FaultAmounts amounts = device.faults().amounts;
  if (name == "delay") {
    amounts.delay = words.seconds();
  } else if (name == "split") {
    amounts.split = words.seconds();
  } else if (name == "hang-up") {
    amounts.hang_up = words.seconds();
  } else if (name == "power-off") {
    amounts.power_off = words.seconds();
  } else if (name == "standstill") {
    amounts.standstill = words.seconds();
  } else if (name == "jump") {
    amounts.jump_measurements = words.whole(1, kMaxJump);
  } else if (name == "error") {
    const auto code = parse_hex(words.take());
    amounts.error_code = static_cast<std::uint8_t>(code.value_or(0));
    if (!code || *code > 0xFF) {
      words.fail("the code after ERROR has two hexadecimal digits");
    }
  } else {
    words.fail("there is no amount '" + std::string(name) +
               "': delay, split, hang-up, power-off, standstill, jump, error");
  }
  words.end();
  if (words.good()) {
    device.faults().amounts = amounts;
  }
}

void set_coil(Words& words, Device& device, CoilFault fault) {
  const int sensor = words.whole(1, kMaxTrackerCoils);
  words.end();
  if (words.good()) {
    device.faults().set_coil(sensor, fault);
  }
}

void unplug(Words& words, Device& device) {
  const int port = words.whole(1, kMaxTrackerCoils);
  words.end();
  if (words.good() && !device.ports().pull_out(port)) {
    words.fail("port " + std::to_string(port) + " has no tool to pull out");
  }
}

/// The tool of the port, or a stranger's with that serial number.
void plug(Words& words, Device& device) {
  const int port = words.whole(1, kMaxTrackerCoils);
  const std::string_view serial = words.take();
  const std::string_view part = words.take();
  words.end();
  const auto number = parse_hex(serial);
  if (!serial.empty() && !number) {
    words.fail("a serial number has up to eight hexadecimal digits");
  }
  if (part.size() > kPartNumberSize) {
    words.fail("a part number has up to " + std::to_string(kPartNumberSize) + " characters");
  }
  if (!words.good()) {
    return;
  }
  PortHandles& ports = device.ports();
  if (number) {
    if (!ports.plug_in_stranger(port, *number, part.empty() ? std::string_view(Plug{}.part_number) : part)) {
      words.fail("port " + std::to_string(port) + " has a tool: unplug it first");
    }
  } else if (!ports.plug_in(port)) {
    words.fail("port " + std::to_string(port) + " has no tool of its own, or has one in it");
  }
}

void set_condition(Words& words, Device& device) {
  const std::string_view name = words.take();
  const auto* const condition = std::find_if(kConditions.begin(), kConditions.end(),
                                             [name](const auto& known) { return known.first == name; });
  if (condition == kConditions.end()) {
    words.fail("there is no condition '" + std::string(name) +
               "': synchronisation, diagnostic, temperature, hardware-changed");
    return;
  }
  const std::string_view state = words.take();
  if (state != "on" && state != "off") {
    words.fail("'" + std::string(state) + "' is neither 'on' nor 'off'");
  }
  words.end();
  if (words.good()) {
    std::uint16_t& bits = device.faults().conditions.raised.bits;
    bits = static_cast<std::uint16_t>(state == "on" ? bits | condition->second : bits & ~condition->second);
  }
}

void move_field_generator(Device& device, bool present) {
  SystemConditions& conditions = device.faults().conditions;
  conditions.field_generator_present = present;
  conditions.raised.bits |= kHardwareChanged;
}

void interrupt(Words& words, Device& device, MonotonicTime now,
               void (Device::*how)(MonotonicTime, std::chrono::nanoseconds)) {
  const std::chrono::nanoseconds duration = words.seconds();
  words.end();
  if (words.good()) {
    (device.*how)(now, duration);
  }
}

/// Commands of one word.
bool apply_word(std::string_view verb, Device& device, MonotonicTime now) {
  if (verb == "disconnect") {
    device.hang_up(now, kForEver);
  } else if (verb == "connect") {
    device.connect();
  } else if (verb == "break") {
    device.receive_break(now);
  } else if (verb == "clear") {
    device.faults().clear();
    device.measurements().go_on();
    device.connect();
  } else if (verb == "unplug-field-generator") {
    move_field_generator(device, false);
  } else if (verb == "plug-field-generator") {
    move_field_generator(device, true);
  } else {
    return false;
  }
  return true;
}

}  // namespace

std::string apply_control(std::string_view command, Device& device, MonotonicTime now) {
  Words words(command);
  const std::string_view verb = words.take();
  if (verb == "fault") {
    set_fault(words, device);
  } else if (verb == "set") {
    set_amount(words, device);
  } else if (verb == "lose-coil") {
    set_coil(words, device, CoilFault::kLost);
  } else if (verb == "break-coil") {
    set_coil(words, device, CoilFault::kBroken);
  } else if (verb == "move-coil-out") {
    set_coil(words, device, CoilFault::kOutOfVolume);
  } else if (verb == "restore-coil") {
    set_coil(words, device, CoilFault::kNone);
  } else if (verb == "unplug") {
    unplug(words, device);
  } else if (verb == "plug") {
    plug(words, device);
  } else if (verb == "status") {
    set_condition(words, device);
  } else if (verb == "hang-up") {
    interrupt(words, device, now, &Device::hang_up);
  } else if (verb == "power-cycle") {
    interrupt(words, device, now, &Device::power_cycle);
  } else {
    words.end();
    if (words.good() && !apply_word(verb, device, now)) {
      words.fail("there is no command '" + std::string(verb) + "'");
    }
  }
  return words.why();
}

}  // namespace tubed::aurora::emulator
