// The other end: measurements of a tracker into the frames of a bus.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/aurora/can_frames.hpp"
#include "drivers/aurora/session.hpp"

namespace tubed {

enum class CanLayout {
  kClassic,  ///< three frames of 8 bytes a coil
  kFd        ///< one frame of 48 bytes a coil
};

/// One measurement as the gateway has it.
struct CanReport {
  aurora::CanSync sync;
  std::array<aurora::HandleReading, aurora::kMaxCanCoils> coils;  ///< absent ones are kDisabled
  std::array<std::uint32_t, aurora::kMaxCanCoils> serial_numbers{};
  aurora::SystemStatus system_status;
  std::uint16_t ports_present = 0;  ///< bit p - 1: port p
  std::uint8_t gateway_error = 0;   ///< kCanSimulated, or 0
};

/// What `session` has just given as `frame` (Event::kMeasurement). The session's coil map says which coil is
/// which.
[[nodiscard]] CanReport can_report(const aurora::Session& session, const EmFrame& frame) noexcept;

/// Gateway's clock of an instant, as it stands in frames: microseconds, wrapped.
[[nodiscard]] std::uint32_t can_time_us(MonotonicTime time) noexcept;

/// Why `session`, whose serial port is open, has given no measurement for a while.
[[nodiscard]] aurora::CanTrackerState can_tracker_state(const aurora::Session& session) noexcept;

/// One thread; never allocates.
class CanPacker {
 public:
  /// Measurements from one STATUS to the next: four STATUS a second, for receivers that join.
  static constexpr int kStatusEvery = 10;
  /// Without measurements STATUS is sent alone, so often.
  static constexpr std::chrono::seconds kStatusPeriod{1};
  static constexpr std::size_t kMaxFrames = 3 + aurora::kClassicParts * aurora::kMaxCanCoils;

  /// `coil_count` coils are sent, 1 to kMaxCanCoils; others are clamped to that.
  CanPacker(CanLayout layout, int coil_count, aurora::CanBase base = {}) noexcept;

  /// SYNC, FOLLOW-UP, STATUS when it is due or has changed, and all coils, in the order in which they have to
  /// be sent, at once: SYNC at `now`. Valid until the next call.
  [[nodiscard]] std::span<const aurora::CanFrame> pack(const CanReport& report, MonotonicTime now) noexcept;

  /// STATUS with no coils and `state` when that is news or a second has passed since the last one, else
  /// nothing. Valid until the next call.
  [[nodiscard]] std::span<const aurora::CanFrame> pack_away(aurora::CanTrackerState state,
                                                            MonotonicTime now) noexcept;

 private:
  void put(const aurora::CanFrame& frame) noexcept { frames_[count_++] = frame; }

  CanLayout layout_;
  int coil_count_;
  aurora::CanBase base_;
  std::array<aurora::CanFrame, kMaxFrames> frames_;
  std::size_t count_ = 0;
  int since_status_ = kStatusEvery;
  aurora::CanFrame last_status_;
  MonotonicTime last_status_sent_{};
};

}  // namespace tubed
