// What the emulated Aurora is told to do wrong, and how often it has.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <random>
#include <string_view>

#include "drivers/aurora/status.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed::aurora::emulator {

enum class Fault {
  // of a reply
  kCrc,         ///< a wrong check sum (of the body)
  kHeaderCrc,   ///< a wrong check sum of a BX header; of text as kCrc
  kLength,      ///< BX: another length under a right header check sum; text: a character doubled
  kTruncate,    ///< the reply ends early and the rest never comes
  kDrop,        ///< a byte is lost
  kGarbage,     ///< up to 20 bytes of noise before it
  kNoReply,     ///< nothing
  kError,       ///< ERRORnn in its place
  kDuplicate,   ///< twice
  kStale,       ///< the tracking reply before it in its place
  kDelay,       ///< late
  kSplit,       ///< a pause in the middle
  kBreak,       ///< the tracker starts anew, as after a serial break, instead of answering
  kHangUp,      ///< the port is gone for a while; the tracker goes on
  kPowerCycle,  ///< the tracker is without power for a while
  // of a measurement
  kCoilBroken,   ///< one coil says it is broken
  kOutOfVolume,  ///< one coil is outside the volume
  kStuck,        ///< new frame number, old poses
  kStandstill,   ///< frame number and poses stand still for a while, also over TSTOP and TSTART
  kCountBack,    ///< the frame counter jumps back, and counts on from there
  kCountOn,      ///< the frame counter jumps on
};
inline constexpr std::size_t kFaultCount = 21;
inline constexpr std::size_t kReplyFaultCount = 15;  ///< the first of them

[[nodiscard]] std::string_view fault_name(Fault fault) noexcept;
[[nodiscard]] std::optional<Fault> find_fault(std::string_view name) noexcept;

/// Which replies a fault of replies may strike.
enum class Scope { kTracking, kAny };

/// When one fault strikes: by chance, and the next `next` times for certain.
struct FaultRule {
  double probability = 0;
  std::uint64_t next = 0;
  Scope scope = Scope::kTracking;
};

/// A lasting fault of one coil.
enum class CoilFault { kNone, kLost, kBroken, kOutOfVolume };

/// What can be set besides.
struct FaultAmounts {
  std::chrono::nanoseconds delay = std::chrono::milliseconds(150);
  std::chrono::nanoseconds split = std::chrono::milliseconds(20);
  std::chrono::nanoseconds hang_up = std::chrono::seconds(1);
  std::chrono::nanoseconds power_off = std::chrono::seconds(2);
  std::chrono::nanoseconds standstill = std::chrono::seconds(12);
  int jump_measurements = 40;  ///< of the frame counter
  std::uint8_t error_code = 0x05;
};

/// What the tracker itself says is wrong, in the system status of every reply, until it is over.
struct SystemConditions {
  SystemStatus raised;
  bool field_generator_present = true;  ///< without it every coil is MISSING
};

/// One thread. At most one fault strikes a reply, and one a measurement: the first that does.
class Faults {
 public:
  explicit Faults(std::uint64_t seed) : random_(seed) {}

  void set(Fault fault, const FaultRule& rule) { rules_[index(fault)] = rule; }
  void set_coil(int sensor, CoilFault fault);
  /// All faults and conditions are over; the counts stay.
  void clear();

  /// What strikes the next reply.
  [[nodiscard]] std::optional<Fault> strike_reply(Scope reply);
  /// What strikes the next measurement.
  [[nodiscard]] std::optional<Fault> strike_measurement();
  /// Of sensor 1, 2, ...
  [[nodiscard]] CoilFault coil(int sensor) const { return coils_[static_cast<std::size_t>(sensor - 1)]; }

  /// How often `fault` has struck.
  [[nodiscard]] std::uint64_t struck(Fault fault) const { return struck_[index(fault)]; }

  /// A whole number from 0 to `limit` - 1.
  [[nodiscard]] std::size_t below(std::size_t limit);

  FaultAmounts amounts;
  SystemConditions conditions;

 private:
  static std::size_t index(Fault fault) { return static_cast<std::size_t>(fault); }
  std::optional<Fault> strike(std::size_t first, std::size_t end, Scope reply);
  bool strikes(FaultRule& rule);

  std::array<FaultRule, kFaultCount> rules_{};
  std::array<std::uint64_t, kFaultCount> struck_{};
  std::array<CoilFault, kMaxTrackerCoils> coils_{};
  std::mt19937_64 random_;
};

}  // namespace tubed::aurora::emulator
