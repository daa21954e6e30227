#include "drivers/aurora/tracked_handles.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

bool is_gone(const HandleReading& reading) noexcept {
  return reading.report == Report::kDisabled || reading.report == Report::kUnoccupied;
}

}  // namespace

void TrackedHandles::start(std::span<const TrackedHandle> handles) noexcept {
  count_ = std::min(handles.size(), tracked_.size());
  std::copy_n(handles.begin(), count_, tracked_.begin());
  for (std::size_t i = 0; i < count_; ++i) {
    numbers_[i] = tracked_[i].handle;
  }
  newest_ = {};
}

void TrackedHandles::take(const TrackingReply& reply) noexcept {
  const auto readings = reply.readings();
  for (std::size_t i = 0; i < count_; ++i) {
    const auto found = std::find_if(readings.begin(), readings.end(), [&](const HandleReading& reading) {
      return reading.handle == tracked_[i].handle;
    });
    newest_[i] = HandleReading{};
    newest_[i].report = Report::kDisabled;
    if (found != readings.end()) {
      newest_[i] = *found;
    }
  }
}

bool TrackedHandles::has_lost(std::uint8_t handle) const noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    if (tracked_[i].handle == handle) {
      return is_gone(newest_[i]);
    }
  }
  return false;
}

bool TrackedHandles::coil_is_absent() const noexcept {
  std::size_t placed = 0;
  for (int coil = 0; coil < coils_.coil_count(); ++coil) {
    placed += coils_.plug(coil) ? 1 : 0;
  }
  const auto end = newest_.begin() + static_cast<std::ptrdiff_t>(count_);
  return count_ < placed || std::any_of(newest_.begin(), end, is_gone);
}

void TrackedHandles::fill(EmFrame& frame) const noexcept {
  const auto end = tracked_.begin() + static_cast<std::ptrdiff_t>(count_);
  const bool simulated =
      std::any_of(tracked_.begin(), end, [](const TrackedHandle& tracked) { return tracked.simulated; });
  frame.origin = simulated ? Origin::kSimulated : Origin::kDevice;
  frame.coil_count = coils_.coil_count();
  CoilSample absent;
  absent.status = CoilStatus::kDisabled;
  std::fill_n(frame.coils.begin(), frame.coil_count, absent);
  for (std::size_t i = 0; i < count_; ++i) {
    frame.coils[static_cast<std::size_t>(tracked_[i].coil)] = coil_sample(newest_[i]);
  }
}

}  // namespace tubed::aurora
