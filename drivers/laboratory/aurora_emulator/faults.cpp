#include "drivers/laboratory/aurora_emulator/faults.hpp"

#include <algorithm>
#include <stdexcept>

namespace tubed::aurora::emulator {

namespace {

constexpr std::array<std::string_view, kFaultCount> kNames = {
    "crc",         "header-crc",  "length",        "truncate", "drop",       "garbage",    "no-reply",
    "error",       "duplicate",   "stale",         "delay",    "split",      "break",      "hang-up",
    "power-cycle", "coil-broken", "out-of-volume", "stuck",    "standstill", "count-back", "count-on"};

}  // namespace

std::string_view fault_name(Fault fault) noexcept { return kNames[static_cast<std::size_t>(fault)]; }

std::optional<Fault> find_fault(std::string_view name) noexcept {
  const auto* const found = std::find(kNames.begin(), kNames.end(), name);
  return found == kNames.end() ? std::nullopt : std::optional(static_cast<Fault>(found - kNames.begin()));
}

void Faults::set_coil(int sensor, CoilFault fault) {
  if (sensor < 1 || sensor > kMaxTrackerCoils) {
    throw std::out_of_range("sensors count from 1 to " + std::to_string(kMaxTrackerCoils));
  }
  coils_[static_cast<std::size_t>(sensor - 1)] = fault;
}

void Faults::clear() {
  rules_.fill({});
  coils_.fill(CoilFault::kNone);
  conditions = {};
}

std::optional<Fault> Faults::strike_reply(Scope reply) { return strike(0, kReplyFaultCount, reply); }

std::optional<Fault> Faults::strike_measurement() {
  return strike(kReplyFaultCount, kFaultCount, Scope::kTracking);
}

std::size_t Faults::below(std::size_t limit) { return random_() % limit; }

std::optional<Fault> Faults::strike(std::size_t first, std::size_t end, Scope reply) {
  for (std::size_t i = first; i < end; ++i) {
    const bool meant = reply == Scope::kTracking || rules_[i].scope == Scope::kAny;
    if (meant && strikes(rules_[i])) {
      ++struck_[i];
      return static_cast<Fault>(i);
    }
  }
  return std::nullopt;
}

bool Faults::strikes(FaultRule& rule) {
  if (rule.next > 0) {
    --rule.next;
    return true;
  }
  return rule.probability > 0 && static_cast<double>(random_() >> 11) * 0x1.0p-53 < rule.probability;
}

}  // namespace tubed::aurora::emulator
