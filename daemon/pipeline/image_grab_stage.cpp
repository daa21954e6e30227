#include "daemon/pipeline/image_grab_stage.hpp"

namespace tubed {

bool ImageGrabStage::step(const Clock& /*clock*/) noexcept {
  if (!has_frame_) {
    return false;
  }
  has_frame_ = false;
  announcement_.back() = mailbox_.back().exposure;
  announcement_.publish();
  superseded_ += mailbox_.publish() ? 1 : 0;
  frangi_bell_.ring();
  ++outputs_;
  return true;
}

void ImageGrabStage::describe(StageReport& report) const noexcept {
  session_.describe(report);
  report.outputs = outputs_;
  report.dropped = superseded_;
}

}  // namespace tubed
