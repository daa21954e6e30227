// The EM measurements of the last seconds, looked up by time. Lives in the optimizer thread (or an offline
// run).
#pragma once

#include <array>
#include <cstddef>

#include "daemon/estimator/em_timeout.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed {

/// Keeps the newest kCapacity measurements (6.4 s at 40 Hz) in order of their time. Never allocates.
class EmHistory {
 public:
  static constexpr std::size_t kCapacity = 256;

  /// Takes the next measurement. One that is not later than the newest is refused (false): time goes forward.
  bool add(const EmFrame& frame);

  /// The newest measurement not later than `time`; nullptr when there is none. Valid until the next add().
  [[nodiscard]] const EmFrame* newest_until(MonotonicTime time) const;

  /// The measurement `steps` before `frame` (which must be of this history); nullptr when it is gone.
  [[nodiscard]] const EmFrame* before(const EmFrame* frame, std::size_t steps) const;

  /// Age of the newest measurement from which on they are stale, `most` at most: see EmTimeout.
  [[nodiscard]] std::chrono::nanoseconds timeout(std::chrono::nanoseconds most) const {
    return timeout_.timeout(most);
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  void clear() { size_ = 0; }

 private:
  [[nodiscard]] const EmFrame& from_newest(std::size_t age) const {
    return frames_[(next_ + kCapacity - 1 - age) % kCapacity];
  }

  std::array<EmFrame, kCapacity> frames_;
  EmTimeout timeout_;
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

}  // namespace tubed
