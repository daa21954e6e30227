// Asks a tracking Aurora for its measurements, each just after it was made, and makes EmFrames of the
// answers.
#pragma once

#include <span>

#include "drivers/aurora/encoding_choice.hpp"
#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/frame_admission.hpp"
#include "drivers/aurora/frame_counter.hpp"
#include "drivers/aurora/measurement_times.hpp"
#include "drivers/aurora/plug_watch.hpp"
#include "drivers/aurora/pose_guard.hpp"
#include "drivers/aurora/reported_handles.hpp"
#include "drivers/aurora/tracked_handles.hpp"
#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

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
  std::uint64_t unsolicited = 0;   ///< replies that no question was waiting for
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
    kNotTracking,   ///< the tracker says so: start tracking again
    kStandstill,    ///< the tracker answers, but its frame counter does not move as time does: the same
    kReset,         ///< the tracker has started anew
    kSilent,        ///< many polls without answer: find the link again
    kGone           ///< the channel is gone
  };

  Poller(const PollerSettings& settings, const CoilMap& coils) : settings_(settings), tracked_(coils) {}

  /// Tracking has begun with these handles enabled; `found` are all that the port setup met.
  void start(std::span<const TrackedHandle> handles, std::span<const std::uint8_t> found,
             MonotonicTime now) noexcept;
  /// Tracking goes on after the line was interrupted, with the same handles.
  void resume(MonotonicTime now) noexcept;
  /// Goes on until something happens or the deadline has come.
  Event step(Exchange& exchange, MonotonicTime deadline, EmFrame& frame) noexcept;
  /// When step() asks next, while no reply is pending.
  [[nodiscard]] MonotonicTime due(const Exchange& exchange) const noexcept {
    return ports_changed_ ? MonotonicTime{} : next_poll(exchange);
  }

  [[nodiscard]] const PollerCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const FrameClock& clock() const noexcept { return times_.clock(); }
  [[nodiscard]] const EncodingChoice& encoding() const noexcept { return encoding_; }
  /// Handles of the newest reply beside those that are tracked.
  [[nodiscard]] const ReportedHandles& handles() const noexcept { return handles_; }
  /// The tracker goes on reporting other handles than those that are enabled, also after the ports were
  /// initialised again: what can be used of its replies is used.
  [[nodiscard]] bool handles_contradict() const noexcept {
    return tolerant_ && agreement_ != ReportedHandles::Agreement::kComplete;
  }
  /// The newest reply says that the tool of `handle` was pulled out, or does not have it.
  [[nodiscard]] bool has_lost(std::uint8_t handle) const noexcept { return tracked_.has_lost(handle); }
  /// Of the newest measurement.
  [[nodiscard]] SystemStatus system_status() const noexcept { return system_status_; }
  /// Newest status that a reply had of the handle at `index` of start().
  [[nodiscard]] const HandleReading& newest(std::size_t index) const noexcept {
    return tracked_.newest(index);
  }
  /// Frame number of the newest reply, believed or not.
  [[nodiscard]] std::uint32_t newest_number() const noexcept { return newest_number_; }

 private:
  /// After a reply that was lost or late another may be on its way: the line has to be quiet for so long.
  static constexpr std::chrono::milliseconds kQuietAfterTrouble{5};

  [[nodiscard]] MonotonicTime next_poll(const Exchange& exchange) const noexcept;
  void poll(Exchange& exchange) noexcept;
  Event unanswered(MonotonicTime now) noexcept;
  Event answered(const Reply& reply, Exchange& exchange, EmFrame& frame) noexcept;
  Event error(std::uint8_t code, MonotonicTime now) noexcept;
  Event measured(Exchange& exchange, EmFrame& frame) noexcept;
  [[nodiscard]] bool handles_agree() noexcept;
  Event contradicted() noexcept;
  Event refused() noexcept;
  bool decode(const Reply& reply) noexcept;
  Event without_number(MonotonicTime now) noexcept;
  Event held_back() noexcept;
  Event repeated(Exchange& exchange) noexcept;
  [[nodiscard]] MeasurementTimes::Answer answer_of(const Exchange& exchange) const noexcept;
  void schedule_probe(MonotonicTime now) noexcept;
  Event deliver(MonotonicTime now, EmFrame& frame) noexcept;
  void settle(MonotonicTime now) noexcept;
  void fill(EmFrame& frame, MonotonicTime now) const noexcept;
  void begin_to_poll(MonotonicTime now) noexcept;

  PollerSettings settings_;
  TrackedHandles tracked_;
  SystemStatus system_status_;

  TrackingReply reply_;
  ReportedHandles handles_;
  EncodingChoice encoding_;
  FrameAdmission admission_;
  FrameCounter counter_;
  MeasurementTimes times_;
  PoseGuard guard_;
  PlugWatch plugs_;
  PollerCounts counts_;

  bool first_seen_ = false;  ///< a measurement since start()
  std::uint32_t newest_number_ = 0;
  std::uint64_t measurement_ = 0;  ///< newest, as counted
  MonotonicTime last_time_{};      ///< measured, of the last frame
  MonotonicTime last_new_{};       ///< when the last new measurement came
  MonotonicTime still_since_{};    ///< polled since, without a new measurement
  MonotonicTime last_step_{};      ///< of step()
  MonotonicTime hold_until_{};     ///< the line must be quiet first
  bool poll_at_once_ = false;
  int settling_polls_ = 0;  ///< answers to earlier polls may come before this one's
  int repetitions_ = 0;     ///< in a row
  bool probe_ = false;      ///< ask early: whether what repetitions proved is still so
  MonotonicTime probe_at_{};
  int standstills_ = 0;  ///< in a row

  int errors_in_a_row_ = 0;
  int contradictions_ = 0;     ///< in a row
  bool contradicted_ = false;  ///< the ports are initialised again because of contradictions
  bool tolerant_ = false;
  ReportedHandles::Agreement agreement_ = ReportedHandles::Agreement::kComplete;  ///< of the newest reply
  bool ports_changed_ = false;
};

}  // namespace tubed::aurora
