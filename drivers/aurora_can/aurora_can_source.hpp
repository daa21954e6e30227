#pragma once

#include <memory>

#include "drivers/aurora/can_coil_assembler.hpp"
#include "drivers/aurora/pose_guard.hpp"
#include "drivers/aurora/words.hpp"
#include "drivers/aurora_can/can_port.hpp"
#include "drivers/aurora_can/gateway_clock.hpp"
#include "drivers/interface/condition.hpp"
#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// What came over the bus and what was wrong with it, since the beginning; beside CanCoilAssembler::Counts.
struct AuroraCanCounts {
  std::uint64_t error_frames = 0;
  std::uint64_t bus_offs = 0;
  std::uint64_t restarts = 0;    ///< of the controller, after bus-off
  std::uint64_t unreadable = 0;  ///< no frames of ours, though their identifiers are
  std::uint64_t leaps = 0;       ///< measurements that were not believed: see aurora::PoseGuard
  std::uint64_t overflowed = 0;  ///< frames that the kernel threw away, or 1 for each time the controller did
};

/// An NDI Aurora behind a gateway on a CAN bus. Called by the EM acquisition thread.
///
/// Interface and gateway are looked for by read() itself, ten times a second, so that what comes back is
/// found at once: open() always succeeds, and what is wrong meanwhile stands in condition(). Opening the
/// interface waits for nothing, so that read() never does; the pause between two tries is in wait().
class AuroraCanSource final : public EmSource, public HasCondition {
 public:
  /// Coil i of a frame is coil i of the gateway, sensor i + 1 of `room`.
  AuroraCanSource(const RoomDescription& room, const DriverSettings& settings, std::unique_ptr<CanPort> port);

  OpenResult open() override;
  /// Until a frame of the bus is there, the measurement that is being put together will not become whole any
  /// more, or it has been silent for so long that it is said.
  void wait(MonotonicTime deadline) noexcept override;
  /// Takes the frames of the bus until they make a measurement, 64 at the most.
  ReadOutcome read(EmFrame& frame) noexcept override;
  void close() noexcept override;
  /// While measurements come: that the gateway has too few coils, else what was lost on the bus within the
  /// last five seconds, else which coils the gateway does not have.
  [[nodiscard]] SourceCondition condition() noexcept override;

  [[nodiscard]] AuroraCanCounts counts() const noexcept;
  [[nodiscard]] const aurora::CanCoilAssembler::Counts& assembler_counts() const noexcept {
    return assembler_.counts();
  }
  /// What the gateway last said of itself and its tracker.
  [[nodiscard]] const std::optional<aurora::CanStatus>& status() const noexcept {
    return assembler_.status();
  }
  [[nodiscard]] const GatewayClock& clock() const noexcept { return clock_; }

 private:
  bool open_port(MonotonicTime now) noexcept;
  ReadOutcome take(const CanArrival& arrival, EmFrame& frame) noexcept;
  ReadOutcome take_nothing(EmFrame& frame) noexcept;
  [[nodiscard]] MonotonicTime whole_until() const noexcept;
  ReadOutcome not_measuring(const aurora::Problem& problem) noexcept;
  [[nodiscard]] aurora::Problem losses_and_lacks() const noexcept;
  ReadOutcome lose_port(int error) noexcept;
  ReadOutcome take_trouble(const CanTrouble& trouble) noexcept;
  ReadOutcome take_frame(const CanArrival& arrival, EmFrame& frame) noexcept;
  ReadOutcome take_follow_up(const CanArrival& arrival) noexcept;
  ReadOutcome hand_on(const aurora::CanMeasurement& measurement, MonotonicTime now, EmFrame& frame) noexcept;
  ReadOutcome silent() noexcept;
  [[nodiscard]] aurora::Problem bus_off() const noexcept;
  [[nodiscard]] bool tracker_is_away(MonotonicTime now) const noexcept;
  void look_at_losses(MonotonicTime now) noexcept;
  [[nodiscard]] bool origin_known(MonotonicTime now) noexcept;
  [[nodiscard]] MonotonicTime measured(const aurora::CanMeasurement& measurement) noexcept;

  /// Counts of what did not come.
  struct Losses {
    std::uint64_t coils = 0;
    std::uint64_t measurements = 0;
    std::uint64_t overflowed = 0;

    friend bool operator==(const Losses&, const Losses&) = default;
  };
  [[nodiscard]] Losses losses() const noexcept;

  std::unique_ptr<CanPort> port_;
  std::chrono::nanoseconds latency_;
  aurora::CanBase base_;
  int coil_count_;
  std::array<bool, kMaxTrackerCoils> used_{};  ///< by an instrument of the configuration
  aurora::CanCoilAssembler assembler_;
  aurora::PoseGuard guard_;
  GatewayClock clock_;
  AuroraCanCounts counts_;

  std::uint8_t sync_sequence_ = 0;
  MonotonicTime sync_received_{};    ///< of the last SYNC
  bool assembling_ = false;          ///< it has not led to a measurement yet
  MonotonicTime follow_up_until_{};  ///< the gateway is one that sends follow-ups
  MonotonicTime last_measured_{};    ///< of the last frame that was handed on
  MonotonicTime heard_since_{};      ///< the first measurement without a STATUS that says it is one
  MonotonicTime status_received_{};  ///< of the last STATUS
  MonotonicTime silent_since_{};     ///< nothing usable since then
  CanTrouble last_trouble_;          ///< reported by the controller since then
  bool troubled_ = false;
  bool is_off_ = false;  ///< the controller has left the bus
  aurora::CanCoilAssembler::Counts counts_when_silent_;

  Losses losses_;               ///< at the last measurement
  Losses losses_at_beginning_;  ///< of the time in which something was lost again and again
  MonotonicTime losing_until_{};
  std::array<bool, kMaxTrackerCoils> disabled_{};  ///< coils that the gateway does not have, at the moment

  aurora::Problem trouble_;  ///< why nothing is measured, until something is
  bool measures_ = false;
  bool has_measured_ = false;
  MonotonicTime next_try_{};
};

}  // namespace tubed
