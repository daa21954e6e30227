#include "daemon/pipeline/em_acquisition_stage.hpp"

namespace tubed {

// Opening is a step of its own: it may take seconds, which are no time of a measurement.
bool EmAcquisitionStage::step(const Clock& clock) noexcept {
  if (!session_.is_open()) {
    session_.open(clock);
    return false;
  }
  const ReadOutcome outcome = session_.read(frame_, clock);
  hand_over_identity();
  if (outcome == ReadOutcome::kFrame) {
    hand_over();
  }
  return came_to_something(outcome);
}

void EmAcquisitionStage::hand_over() noexcept {
  for (const EmHandOver& to : {to_optimizer_, to_publisher_}) {
    to.ring.push(frame_);
    to.bell.ring();
  }
  ++outputs_;
}

void EmAcquisitionStage::hand_over_identity() noexcept {
  if (identity_ == nullptr || identity_->identity() == handed_over_) {
    return;
  }
  handed_over_ = identity_->identity();
  tracker_.back() = handed_over_;
  tracker_.publish();
  to_publisher_.bell.ring();
}

void EmAcquisitionStage::describe(StageReport& report) const noexcept {
  session_.describe(report);
  report.outputs = outputs_;
  report.dropped = to_optimizer_.ring.refused() + to_publisher_.ring.refused();
}

}  // namespace tubed
