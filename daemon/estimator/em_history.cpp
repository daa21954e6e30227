#include "daemon/estimator/em_history.hpp"

namespace tubed {

bool EmHistory::add(const EmFrame& frame) {
  if (size_ > 0 && frame.measured <= from_newest(0).measured) {
    return false;
  }
  timeout_.saw(frame.measured, frame.received);
  frames_[next_] = frame;
  next_ = (next_ + 1) % kCapacity;
  size_ = size_ < kCapacity ? size_ + 1 : kCapacity;
  return true;
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
