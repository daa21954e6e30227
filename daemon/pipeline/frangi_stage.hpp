#pragma once

#include "daemon/image/frangi.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/stage.hpp"
#include "daemon/pipeline/triple_buffer.hpp"

namespace tubed {

/// Measures the newest image of one camera, once for all instruments. See Stage.
class FrangiStage final : public Stage {
 public:
  FrangiStage(int camera, FrangiFilter filter, TripleBuffer<ImageFrame>& from_grab,
              TripleBuffer<ImageMeasurement>& to_optimizer, Doorbell& own_bell, Doorbell& optimizer_bell)
      : camera_(camera),
        filter_(std::move(filter)),
        from_grab_(from_grab),
        to_optimizer_(to_optimizer),
        bell_(own_bell),
        optimizer_bell_(optimizer_bell) {}

  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(clock.now() + std::chrono::milliseconds(100));
  }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override;

 private:
  int camera_;
  FrangiFilter filter_;
  TripleBuffer<ImageFrame>& from_grab_;
  TripleBuffer<ImageMeasurement>& to_optimizer_;
  Doorbell& bell_;
  Doorbell& optimizer_bell_;
  std::uint64_t previous_sum_ = 0;
  ImageRejection newest_rejection_ = ImageRejection::kNone;
  bool seen_any_ = false;
  std::uint64_t outputs_ = 0;
  std::uint64_t superseded_ = 0;
  std::uint64_t refused_ = 0;
};

/// "image is black" and the like, for people.
const char* words_of(ImageRejection rejection);

}  // namespace tubed
