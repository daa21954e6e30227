#include "drivers/aurora/frame_counter.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

constexpr std::uint32_t kHalfway = 0x8000'0000;
/// An old number followed by one at most this far ahead (1 s) is a counter that started anew.
constexpr std::uint32_t kSoonAfter = 40 * kCountsPerMeasurement;

}  // namespace

FrameStep FrameCounter::observe(std::uint32_t frame) noexcept {
  if (!started_) {
    started_ = true;
    last_ = frame;
    return {FrameKind::kFirst, 0, 0};
  }
  const std::uint32_t ahead = frame - last_;
  if (ahead == 0) {
    return {FrameKind::kDuplicate, measurement_, 0};
  }
  if (ahead < kHalfway) {
    return advance(FrameKind::kNew, frame, ahead);
  }
  const std::uint32_t since_old = frame - old_;
  if (old_seen_ && since_old != 0 && since_old <= kSoonAfter) {
    return advance(FrameKind::kRestarted, frame, since_old);
  }
  old_seen_ = true;
  old_ = frame;
  return {FrameKind::kOld, measurement_, 0};
}

FrameStep FrameCounter::advance(FrameKind kind, std::uint32_t frame, std::uint32_t counts) noexcept {
  odd_steps_ += counts % kCountsPerMeasurement == 0 ? 0 : 1;
  const std::uint32_t measurements =
      std::max(1U, static_cast<std::uint32_t>((std::uint64_t{counts} + kCountsPerMeasurement / 2) /
                                              kCountsPerMeasurement));
  last_ = frame;
  old_seen_ = false;
  measurement_ += measurements;
  return {kind, measurement_, measurements - 1};
}

}  // namespace tubed::aurora
