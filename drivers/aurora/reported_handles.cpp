#include "drivers/aurora/reported_handles.hpp"

#include <algorithm>

namespace tubed::aurora {

void ReportedHandles::start(std::span<const std::uint8_t> tracked,
                            std::span<const std::uint8_t> found) noexcept {
  *this = ReportedHandles();
  tracked_count_ = std::min(tracked.size(), tracked_.size());
  std::copy_n(tracked.begin(), tracked_count_, tracked_.begin());
  for (const std::uint8_t handle : this->tracked()) {
    is_tracked_.set(handle);
  }
  is_known_ = is_tracked_;
  for (const std::uint8_t handle : found) {
    is_known_.set(handle);
  }
}

ReportedHandles::Agreement ReportedHandles::compare(const TrackingReply& reply) noexcept {
  Set seen;
  bool foreign_enabled = false;
  count_ = 0;
  newcomer_ = -1;
  for (const HandleReading& reading : reply.readings()) {
    if (seen.test(reading.handle)) {
      return Agreement::kTwice;
    }
    seen.set(reading.handle);
    reported_[count_++] = reading.handle;
    const bool enabled = reading.report != Report::kDisabled && reading.report != Report::kUnoccupied;
    foreign_enabled |= enabled && !is_tracked_.test(reading.handle);
    if (newcomer_ < 0 && !is_known_.test(reading.handle)) {
      newcomer_ = reading.handle;
    }
  }
  if ((is_tracked_ & ~seen).any()) {
    return Agreement::kTrackedAbsent;
  }
  return foreign_enabled ? Agreement::kForeignEnabled : Agreement::kComplete;
}

}  // namespace tubed::aurora
