// Makes measurements out of CAN frames: SYNC, then the coils that carry its sequence number, all within a
// time.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/aurora/can_frames.hpp"
#include "drivers/aurora/frame_counter.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

/// All coils of one measurement.
struct CanMeasurement {
  CanSync sync;
  FrameStep step;                 ///< how it follows the measurement before
  MonotonicTime sync_received{};  ///< when the host had its SYNC
  MonotonicTime last_received{};  ///< when the host had the last frame that is in it
  int coil_count = 0;
  int coils_lost = 0;  ///< coils whose frames did not come, or not all: they are kMissing here
  std::array<CanCoil, kMaxCanCoils> coils;
};

/// One thread. Time comes as a value. Never allocates.
///
/// A coil is taken only when its check sums are right, it belongs to the SYNC that came last, and it is whole
/// within kAssemblyTime of that. A measurement leaves when its last coil is there, when the next SYNC comes,
/// or by expire() when its time is over, whichever is first; one without any coil never leaves.
class CanCoilAssembler {
 public:
  static constexpr std::chrono::milliseconds kAssemblyTime{20};

  /// What came and what was not used, since the beginning.
  struct Counts {
    std::uint64_t measurements = 0;
    std::uint64_t missed = 0;         ///< measurements whose SYNC never came, by the frame numbers
    std::uint64_t empty = 0;          ///< SYNCs that no whole coil followed
    std::uint64_t lost_coils = 0;     ///< coils missing in measurements that left or were empty
    std::uint64_t partial_coils = 0;  ///< of these, those of which one or two classic parts came
    std::uint64_t bad_frames = 0;     ///< check sum, size or content is wrong
    std::uint64_t unmatched = 0;      ///< coil frames that belong to no open measurement, or come too late
    std::uint64_t duplicates = 0;     ///< coil frames that had come already, and repeated SYNCs
    std::uint64_t old_syncs = 0;      ///< SYNCs of measurements before the last
    std::uint64_t foreign = 0;        ///< identifiers that are none of ours
    std::uint64_t statuses = 0;
    std::uint64_t unexpected_coils = 0;  ///< coils beyond those that were asked for
  };

  /// `coil_count` coils are expected, 1 to kMaxCanCoils; others are clamped to that. Frames of
  /// another base are foreign.
  explicit CanCoilAssembler(int coil_count, CanBase base = {}) noexcept;

  /// Takes in one frame that the host got at `received`. Gives the measurement that this completes or ends.
  [[nodiscard]] std::optional<CanMeasurement> accept(const CanFrame& frame, MonotonicTime received) noexcept;

  /// Gives the open measurement when its time is over at `now`.
  [[nodiscard]] std::optional<CanMeasurement> expire(MonotonicTime now) noexcept;

  /// What the gateway last said of itself; nothing before it has.
  [[nodiscard]] const std::optional<CanStatus>& status() const noexcept { return status_; }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  struct Coil {
    bool whole = false;
    std::uint8_t parts_seen = 0;  // bit p: classic part p has come
    std::array<CanClassicPart, kClassicParts> parts{};
  };

  std::optional<CanMeasurement> accept_sync(const CanFrame& frame, MonotonicTime received) noexcept;
  std::optional<CanMeasurement> accept_fd(const CanFrame& frame, MonotonicTime received) noexcept;
  std::optional<CanMeasurement> accept_classic(const CanFrame& frame, MonotonicTime received) noexcept;
  void accept_status(const CanFrame& frame) noexcept;
  bool belongs(int coil, bool matches, MonotonicTime received) noexcept;
  std::optional<CanMeasurement> put(const CanCoil& coil, MonotonicTime received) noexcept;
  std::optional<CanMeasurement> finish() noexcept;

  CanBase base_;
  int coil_count_;
  bool open_ = false;
  int whole_ = 0;
  CanMeasurement measurement_;
  std::array<Coil, kMaxCanCoils> coils_;
  FrameCounter frames_;
  std::optional<CanStatus> status_;
  Counts counts_;
};

}  // namespace tubed::aurora
