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

/// All calls but wake() come from the stage's own thread. After start-up neither wait() nor step() allocates,
/// locks, logs or throws (the publisher excepted).
class Stage {
 public:
  virtual ~Stage() = default;
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// Sleeps until there may be something to do, a tenth of a second at most.
  virtual void wait(const Clock& clock) noexcept = 0;
  /// Does what there is to do; false when there was nothing.
  virtual bool step(const Clock& clock) noexcept = 0;
  /// Ends a wait() early. Any thread.
  virtual void wake() noexcept = 0;
  /// Adds state and counters to what the thread itself reports.
  virtual void describe(StageReport& report) const noexcept = 0;
};

}  // namespace tubed
