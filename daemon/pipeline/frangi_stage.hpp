#pragma once

#include <optional>

#include "daemon/estimator/images/area_prediction.hpp"
#include "daemon/image/image_checks.hpp"
#include "daemon/image/vesselness_meter.hpp"
#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/preview_tap.hpp"
#include "daemon/pipeline/stage.hpp"
#include "daemon/pipeline/triple_buffer.hpp"

namespace tubed {

/// What one camera's images are measured with.
struct ImageHalf {
  ImageDoor door;
  VesselnessMeter meter;
};

/// Measures the newest image of one camera, once for all instruments: where the optimizer says that it will
/// be read, the whole image when it has not said so. See Stage.
class FrangiStage final : public Stage {
 public:
  /// `configured`: brings the camera's geometry when the configuration changes it; nullptr: it never does.
  FrangiStage(int camera, ImageHalf image_half, TripleBuffer<ImageFrame>& from_grab,
              TripleBuffer<PredictedArea>& from_optimizer, TripleBuffer<ImageMeasurement>& to_optimizer,
              Doorbell& own_bell, Doorbell& optimizer_bell, TripleBuffer<ViewGeometry>* configured = nullptr)
      : camera_(camera),
        image_half_(std::move(image_half)),
        from_grab_(from_grab),
        from_optimizer_(from_optimizer),
        to_optimizer_(to_optimizer),
        bell_(own_bell),
        optimizer_bell_(optimizer_bell),
        configured_(configured),
        whole_(to_optimizer_.front().measured) {
    whole_.add_whole();
  }

  /// Before the thread starts: images go there too, for people.
  void set_preview(PreviewTap tap) { preview_.emplace(tap); }

  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(clock.now() + std::chrono::milliseconds(100));
  }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override;

 private:
  void measure(const ImageFrame& frame, ImageMeasurement& measurement) noexcept;

  int camera_;
  ImageHalf image_half_;
  TripleBuffer<ImageFrame>& from_grab_;
  TripleBuffer<PredictedArea>& from_optimizer_;
  TripleBuffer<ImageMeasurement>& to_optimizer_;
  Doorbell& bell_;
  Doorbell& optimizer_bell_;
  TripleBuffer<ViewGeometry>* configured_;
  ImageArea whole_;
  std::optional<PreviewTap> preview_;
  ImageRejection newest_rejection_ = ImageRejection::kNone;
  bool seen_any_ = false;
  std::uint64_t outputs_ = 0;
  std::uint64_t superseded_ = 0;
  std::uint64_t refused_ = 0;
};

/// "image is black" and the like, for people.
const char* words_of(ImageRejection rejection);

}  // namespace tubed
