// Decides which fault strikes when, from one seed, and damages replies.
// Used by SecondAurora only, in its thread.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "tests/second_aurora/settings.hpp"
#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

// What the device is about to send, as far as faults care.
struct ReplyKind {
  bool tracking = false;      // a measurement, not an ERROR
  bool binary = false;        // starts with C4 A5
  bool has_previous = false;  // another tracking reply in the same form was sent before: Stale can strike
};

class Mischief {
 public:
  Mischief(std::vector<Fault> faults, std::uint64_t seed);

  void add(const Fault& fault) { faults_.push_back(fault); }
  void clear() { faults_.clear(); }

  // The fault of this reply; the first of the list that strikes.
  std::optional<Fault> on_reply(const ReplyKind& reply);
  // All faults that begin with this measurement.
  std::vector<Fault> on_measurement();

  // The reply as the fault leaves it, for kinds that change bytes only; otherwise unchanged.
  Bytes damaged(const Fault& fault, const Bytes& reply);

  double uniform();                      // in [0, 1)
  std::size_t below(std::size_t count);  // in [0, count)
  std::uint8_t noise() { return static_cast<std::uint8_t>(below(256)); }
  const std::array<std::uint64_t, kFaultKinds>& struck() const { return struck_; }

 private:
  bool strikes(Fault& fault);

  std::vector<Fault> faults_;
  std::mt19937_64 random_;
  std::array<std::uint64_t, kFaultKinds> struck_{};
};

}  // namespace tubed::second_aurora
