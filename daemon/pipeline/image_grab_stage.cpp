#include "daemon/pipeline/image_grab_stage.hpp"

#include <algorithm>
#include <cstdio>

namespace tubed {

// Opening is a step of its own: it may take seconds, which are no time of an image.
bool ImageGrabStage::step(const Clock& clock) noexcept {
  if (!session_.is_open()) {
    session_.open(clock);
    return false;
  }
  const ReadOutcome outcome = session_.read(mailbox_.back(), clock);
  const MonotonicTime now = clock.now();
  if (outcome == ReadOutcome::kFrame) {
    ImageFrame& frame = mailbox_.back();
    frame.exposure = std::min(frame.exposure - time_offset_, std::max(now, frame.exposure));
    take(now);
  }
  is_thinning_ = left_out_ > 0 && now - newest_left_out_ < std::chrono::seconds(1);
  return came_to_something(outcome);
}

void ImageGrabStage::take(MonotonicTime now) noexcept {
  if (limit_.lets_through(now)) {
    hand_over();
  } else {
    ++left_out_;
    newest_left_out_ = now;
  }
}

void ImageGrabStage::hand_over() noexcept {
  if (cover_ != nullptr) {
    cover_->cover(mailbox_.back());
  }
  announcement_.back() = mailbox_.back().exposure;
  announcement_.publish();
  // Before the frame is handed over, so that the verdict is there when the filter has finished.
  view_.offer(mailbox_.back());
  superseded_ += mailbox_.publish() ? 1 : 0;
  frangi_bell_.ring();
  ++outputs_;
}

void ImageGrabStage::describe(StageReport& report) const noexcept {
  session_.describe(report);
  report.outputs = outputs_;
  report.dropped = superseded_ + left_out_;
  if (is_thinning_ && report.why[0] == '\0') {
    std::snprintf(report.why.data(), report.why.size(),
                  "images come faster than daemon.rate_hz = %g: the newest are used, the rest is dropped",
                  rate_hz_);
  }
}

}  // namespace tubed
