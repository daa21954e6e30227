#pragma once

#include <utility>
#include <vector>

#include "daemon/pipeline/preview_tap.hpp"
#include "daemon/pipeline/stage.hpp"

namespace tubed {

/// Hands the previews of all cameras to their outlet. Its thread has no real-time priority: whatever viewers
/// do costs the measurements nothing. See Stage.
class PreviewStage final : public Stage {
 public:
  /// `outlet` and the mailboxes outlive the stage, the bell too.
  PreviewStage(std::vector<TripleBuffer<ImageFrame>*> from_frangi, PreviewOutlet& outlet, Doorbell& bell)
      : from_frangi_(std::move(from_frangi)), outlet_(outlet), bell_(bell) {}

  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(clock.now() + std::chrono::milliseconds(50));
  }
  bool step(const Clock& /*clock*/) noexcept override {
    bool is_any = false;
    for (std::size_t camera = 0; camera < from_frangi_.size(); ++camera) {
      if (!from_frangi_[camera]->fetch()) continue;
      outlet_.put(camera, from_frangi_[camera]->front());
      ++outputs_;
      is_any = true;
    }
    outlet_.beat();
    return is_any;
  }
  void wake() noexcept override { bell_.ring(); }
  /// Everything else comes first on a busy machine.
  [[nodiscard]] std::chrono::nanoseconds max_silence() const noexcept override {
    return std::chrono::seconds(2);
  }
  void describe(StageReport& report) const noexcept override {
    report.state = StageState::kRunning;
    report.outputs = outputs_;
  }

 private:
  std::vector<TripleBuffer<ImageFrame>*> from_frangi_;
  PreviewOutlet& outlet_;
  Doorbell& bell_;
  std::uint64_t outputs_ = 0;
};

}  // namespace tubed
