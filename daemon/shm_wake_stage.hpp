// The wake-up of many readers, off the publisher thread.
#pragma once

#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/stage.hpp"
#include "daemon/publishing/shm_publisher.hpp"

namespace tubed {

/// Wakes the readers of shared memory that the publisher leaves asleep. Its thread has no real-time priority:
/// thousands of sleeping readers cost their own share of the machine and no more. wake() is the publisher
/// thread's call. See Stage.
class ShmWakeStage final : public Stage {
 public:
  /// `publisher` outlives this object.
  explicit ShmWakeStage(ShmPublisher& publisher) : publisher_(publisher) {}

  void wait(const Clock& clock) noexcept override {
    is_rung_ = bell_.wait_until(clock.now() + std::chrono::milliseconds(100));
  }
  bool step(const Clock& /*clock*/) noexcept override {
    if (is_rung_) {
      publisher_.wake_sleepers();
    }
    return is_rung_;
  }
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override { report.state = StageState::kRunning; }

 private:
  ShmPublisher& publisher_;
  Doorbell bell_;
  bool is_rung_ = false;
};

}  // namespace tubed
