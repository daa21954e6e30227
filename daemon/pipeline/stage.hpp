// A stage of the pipeline: an object that can be stepped without a thread.
#pragma once

#include "drivers/interface/timestamps.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// Where a stage gets its time from: the stage thread's clock, or a test's.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual MonotonicTime now() const noexcept = 0;
};

inline constexpr std::chrono::milliseconds kSilence{250};

/// All calls but wake() come from the stage's own thread. After start-up neither wait() nor step() allocates,
/// locks, logs or throws (the publisher excepted).
class Stage {
 public:
  virtual ~Stage() = default;
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// Sleeps until there may be something to do, a tenth of a second at most, and does nothing else.
  virtual void wait(const Clock& clock) noexcept = 0;
  /// Does what there is to do, and waits for nothing. True when that was what the stage is for, which counts
  /// it among the steps and its duration in `busy`; false when there was nothing, or something beside (a
  /// source was opened, a measurement was put into the history).
  virtual bool step(const Clock& clock) noexcept = 0;
  /// Ends a wait() early. Any thread.
  virtual void wake() noexcept = 0;
  /// Without a sign of life for so long it counts as failed. Of a stage that is never real-time more.
  [[nodiscard]] virtual std::chrono::nanoseconds max_silence() const noexcept { return kSilence; }
  /// Adds state and counters to what the thread itself reports.
  virtual void describe(StageReport& report) const noexcept = 0;
};

}  // namespace tubed
