#pragma once

#include <memory>

#include "daemon/pipeline/source_session.hpp"
#include "daemon/pipeline/triple_buffer.hpp"
#include "drivers/interface/image_source.hpp"

namespace tubed {

/// Reads one view of the fluoroscope into the newest-frame mailbox, and announces the exposure to the
/// optimizer so that it can wait for the second view of the same instant. See Stage.
class ImageGrabStage final : public Stage {
 public:
  ImageGrabStage(std::unique_ptr<ImageSource> source, const PipelineSettings& settings,
                 TripleBuffer<ImageFrame>& mailbox, TripleBuffer<MonotonicTime>& announcement,
                 Doorbell& frangi_bell)
      : session_(std::move(source), settings),
        mailbox_(mailbox),
        announcement_(announcement),
        frangi_bell_(frangi_bell) {}

  void wait(const Clock& clock) noexcept override { has_frame_ = session_.read(mailbox_.back(), clock); }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { session_.interrupt(); }
  void describe(StageReport& report) const noexcept override;

 private:
  SourceSession<ImageSource, ImageFrame> session_;
  TripleBuffer<ImageFrame>& mailbox_;
  TripleBuffer<MonotonicTime>& announcement_;
  Doorbell& frangi_bell_;
  bool has_frame_ = false;
  std::uint64_t outputs_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace tubed
