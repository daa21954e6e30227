#include "daemon/pipeline/em_acquisition_stage.hpp"

namespace tubed {

bool EmAcquisitionStage::step(const Clock& /*clock*/) noexcept {
  hand_over_identity();
  if (!has_frame_) {
    return false;
  }
  has_frame_ = false;
  to_optimizer_.push(frame_);
  to_publisher_.push(frame_);
  publisher_bell_.ring();
  ++outputs_;
  return true;
}

void EmAcquisitionStage::hand_over_identity() noexcept {
  if (identity_ == nullptr || identity_->identity() == handed_over_) {
    return;
  }
  handed_over_ = identity_->identity();
  tracker_.back() = handed_over_;
  tracker_.publish();
  publisher_bell_.ring();
}

void EmAcquisitionStage::describe(StageReport& report) const noexcept {
  session_.describe(report);
  report.outputs = outputs_;
  report.dropped = to_optimizer_.refused() + to_publisher_.refused();
}

}  // namespace tubed
