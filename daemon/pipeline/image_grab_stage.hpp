#pragma once

#include <memory>

#include "daemon/image/mask_cover.hpp"
#include "daemon/pipeline/image_rate_limit.hpp"
#include "daemon/pipeline/source_session.hpp"
#include "daemon/pipeline/triple_buffer.hpp"
#include "daemon/pipeline/view_stage.hpp"
#include "drivers/interface/image_source.hpp"

namespace tubed {

/// Reads one view of the fluoroscope into the newest-frame mailbox, and announces the exposure to the
/// optimizer so that it can wait for the second view of the same instant. A copy goes to the view's watch.
/// Images that come faster than PipelineSettings::rate_hz are thinned out to it, counted as dropped and told.
/// `time_offset` is what the source's stamps are late by: taken off before anybody sees them, so that it
/// holds for every driver; nothing was exposed after it had come. `cover`: of the camera's masks, likewise.
/// See Stage.
class ImageGrabStage final : public Stage {
 public:
  ImageGrabStage(std::unique_ptr<ImageSource> source, const PipelineSettings& settings,
                 TripleBuffer<ImageFrame>& mailbox, TripleBuffer<MonotonicTime>& announcement,
                 Doorbell& frangi_bell, ViewInlet view = {}, std::chrono::nanoseconds time_offset = {},
                 std::unique_ptr<MaskCover> cover = nullptr)
      : session_(std::move(source), settings),
        limit_(settings.rate_hz),
        rate_hz_(settings.rate_hz),
        mailbox_(mailbox),
        announcement_(announcement),
        frangi_bell_(frangi_bell),
        view_(view),
        time_offset_(time_offset),
        cover_(std::move(cover)) {}

  void wait(const Clock& clock) noexcept override { session_.wait(clock); }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { session_.interrupt(); }
  void describe(StageReport& report) const noexcept override;

 private:
  void take(MonotonicTime now) noexcept;
  void hand_over() noexcept;

  SourceSession<ImageSource, ImageFrame> session_;
  ImageRateLimit limit_;
  double rate_hz_;
  TripleBuffer<ImageFrame>& mailbox_;
  TripleBuffer<MonotonicTime>& announcement_;
  Doorbell& frangi_bell_;
  ViewInlet view_;
  std::chrono::nanoseconds time_offset_;
  std::unique_ptr<MaskCover> cover_;  ///< nullptr: there are no masks
  std::uint64_t outputs_ = 0;
  std::uint64_t superseded_ = 0;
  std::uint64_t left_out_ = 0;
  MonotonicTime newest_left_out_{};
  bool is_thinning_ = false;  ///< an image was left out within a second
};

}  // namespace tubed
