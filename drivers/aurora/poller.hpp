// Asks a tracking Aurora for its measurements, each just after it was made, and makes EmFrames of the
// answers.
#pragma once

#include <span>

#include "drivers/aurora/coil_map.hpp"
#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/frame_clock.hpp"
#include "drivers/aurora/frame_counter.hpp"
#include "drivers/aurora/pose_guard.hpp"
#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

/// A handle that is tracked, and the coil of an EmFrame that it is.
struct TrackedHandle {
  std::uint8_t handle = 0;
  int coil = 0;
  bool simulated = false;
};

struct PollerSettings {
  std::chrono::nanoseconds reply_margin = std::chrono::milliseconds(40);  ///< beyond the time on the wire
  std::chrono::nanoseconds latency{0};  ///< from measurement to its readiness in the tracker
};

/// What polling came to since the beginning.
struct PollerCounts {
  std::uint64_t polls = 0;
  std::uint64_t measurements = 0;
  std::uint64_t duplicates = 0;    ///< replies with a measurement already seen
  std::uint64_t missed = 0;        ///< measurements that no reply had
  std::uint64_t unanswered = 0;    ///< no reply, or a damaged one
  std::uint64_t errors = 0;        ///< ERRORnn
  std::uint64_t refused = 0;       ///< replies that contradict what is known: handles, frame numbers, leaps
  std::uint64_t tx_fallbacks = 0;  ///< times that BX was given up
};

/// One thread; never allocates. Between start() and any event that ends tracking.
class Poller {
 public:
  enum class Event {
    kQuiet,         ///< nothing new until the deadline
    kMeasurement,   ///< the frame was filled
    kRefused,       ///< a reply that cannot be used, or none
    kPortsChanged,  ///< a plug was pulled or put in that is of interest: initialise the ports again
    kNotTracking,   ///< the tracker says so, or measures no more: start tracking again
    kReset,         ///< the tracker has started anew
    kSilent,        ///< many polls without answer: find the link again
    kGone           ///< the channel is gone
  };

  Poller(const PollerSettings& settings, const CoilMap& coils) : settings_(settings), coils_(coils) {}

  /// Tracking has begun with these handles enabled.
  void start(std::span<const TrackedHandle> handles, MonotonicTime now) noexcept;
  /// Tracking goes on after the line was interrupted, with the same handles.
  void resume(MonotonicTime now) noexcept;
  /// Goes on until something happens or the deadline has come.
  Event step(Exchange& exchange, MonotonicTime deadline, EmFrame& frame) noexcept;

  [[nodiscard]] const PollerCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const FrameClock& clock() const noexcept { return clock_; }
  /// Binary replies are not to be had: text is used.
  [[nodiscard]] bool uses_text() const noexcept { return text_mode_; }
  /// The newest reply says that the tool of `handle` was pulled out.
  [[nodiscard]] bool has_lost(std::uint8_t handle) const noexcept;
  /// Of the newest measurement.
  [[nodiscard]] SystemStatus system_status() const noexcept { return system_status_; }
  /// Newest status that a reply had of the handle at `index` of start().
  [[nodiscard]] const HandleReading& newest(std::size_t index) const noexcept { return newest_[index]; }

 private:
  [[nodiscard]] MonotonicTime next_poll(const Exchange& exchange) const noexcept;
  void poll(Exchange& exchange) noexcept;
  Event unanswered(MonotonicTime now) noexcept;
  Event answered(const Reply& reply, Exchange& exchange, EmFrame& frame) noexcept;
  Event error(std::uint8_t code, MonotonicTime now) noexcept;
  Event measured(Exchange& exchange, EmFrame& frame) noexcept;
  Event contradicted() noexcept;
  bool decode(const Reply& reply) noexcept;
  void link_works(bool binary, MonotonicTime now) noexcept;
  bool believable_number(std::uint32_t number, MonotonicTime now) noexcept;
  Event without_number(MonotonicTime now) noexcept;
  void fill(EmFrame& frame, std::uint64_t measurement, MonotonicTime now) const noexcept;
  void look_at_ports(MonotonicTime now) noexcept;
  void begin_to_poll(MonotonicTime now) noexcept;

  PollerSettings settings_;
  CoilMap coils_;
  std::array<TrackedHandle, kMaxTrackerCoils> tracked_{};
  std::array<std::uint8_t, kMaxTrackerCoils> handles_{};
  std::size_t handle_count_ = 0;
  bool simulated_ = false;
  std::array<HandleReading, kMaxTrackerCoils> newest_{};
  SystemStatus system_status_;

  TrackingReply reply_;
  FrameCounter counter_;
  FrameClock clock_;
  PoseGuard guard_;
  PollerCounts counts_;

  bool first_seen_ = false;
  std::uint32_t last_number_ = 0;
  std::uint64_t measurement_ = 0;  ///< newest, as counted
  MonotonicTime last_time_{};      ///< measured, of the last frame
  MonotonicTime last_new_{};       ///< when the last new measurement came
  MonotonicTime still_since_{};    ///< polled since, without a new measurement
  MonotonicTime last_step_{};      ///< of step()
  MonotonicTime hold_until_{};     ///< the line must be quiet first
  bool poll_at_once_ = false;
  int settling_polls_ = 0;  ///< answers to earlier polls may come before this one's

  bool text_mode_ = false;
  bool asked_text_ = false;
  MonotonicTime try_binary_at_{};
  int binary_failures_ = 0;  ///< in a row
  int text_successes_ = 0;   ///< meanwhile
  int failures_ = 0;         ///< in a row
  int errors_in_a_row_ = 0;
  int contradictions_ = 0;
  std::uint32_t doubted_number_ = 0;
  bool number_in_doubt_ = false;

  bool occupied_bit_ = false;
  bool occupied_known_ = false;
  bool coil_absent_ = false;
  bool ports_changed_ = false;
  MonotonicTime look_again_at_ = MonotonicTime::max();
  std::chrono::nanoseconds look_again_after_ = std::chrono::seconds(2);
};

}  // namespace tubed::aurora
