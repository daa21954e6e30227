#include "daemon/estimator/coils/em_history.hpp"

namespace tubed {

bool EmHistory::add(const EmFrame& frame) {
  if (newest_ && frame.measured <= *newest_) {
    return false;
  }
  newest_ = frame.measured;
  timeout_.saw(frame.measured, frame.received);
  const std::optional<EmPlacement> placement = reference_.take(frame);
  if (!placement) {
    return true;
  }
  placements_[next_] = *placement;
  frames_[next_] = frame;
  next_ = (next_ + 1) % kCapacity;
  size_ = size_ < kCapacity ? size_ + 1 : kCapacity;
  return true;
}

const EmPlacement& EmHistory::placement(const EmFrame* frame) const {
  const bool is_ours = frame >= frames_.data() && frame < frames_.data() + frames_.size();
  return is_ours ? placements_[static_cast<std::size_t>(frame - frames_.data())] : as_registered_;
}

const EmFrame* EmHistory::newest_until(MonotonicTime time) const {
  for (std::size_t age = 0; age < size_; ++age) {
    if (from_newest(age).measured <= time) {
      return &from_newest(age);
    }
  }
  return nullptr;
}

const EmFrame* EmHistory::before(const EmFrame* frame, std::size_t steps) const {
  for (std::size_t age = 0; age + steps < size_; ++age) {
    if (&from_newest(age) == frame) {
      return &from_newest(age + steps);
    }
  }
  return nullptr;
}

}  // namespace tubed
