// The handles that are tracked, what the newest reply has of them, and the coils that they are.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/aurora/coil_map.hpp"
#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

/// A handle that is tracked, and the coil of an EmFrame that it is.
struct TrackedHandle {
  std::uint8_t handle = 0;
  int coil = 0;
  bool simulated = false;
};

/// One thread; no allocation.
class TrackedHandles {
 public:
  explicit TrackedHandles(const CoilMap& coils) : coils_(coils) {}

  /// Tracking has begun with these.
  void start(std::span<const TrackedHandle> handles) noexcept;

  /// Takes what a reply has of them; one that it does not have is disabled.
  void take(const TrackingReply& reply) noexcept;

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  /// Their numbers, in the order of start().
  [[nodiscard]] std::span<const std::uint8_t> numbers() const noexcept { return {numbers_.data(), count_}; }
  /// Newest reading of the one at `index` of start().
  [[nodiscard]] const HandleReading& newest(std::size_t index) const noexcept { return newest_[index]; }
  /// The newest reply says that the tool of `handle` was pulled out, or does not have it.
  [[nodiscard]] bool has_lost(std::uint8_t handle) const noexcept;
  /// A coil of the configuration has no handle, or the tool of its handle is gone.
  [[nodiscard]] bool coil_is_absent() const noexcept;

  /// Fills origin and coils of the frame from the newest readings.
  void fill(EmFrame& frame) const noexcept;

 private:
  CoilMap coils_;
  std::array<TrackedHandle, kMaxTrackerCoils> tracked_{};
  std::array<std::uint8_t, kMaxTrackerCoils> numbers_{};
  std::size_t count_ = 0;
  std::array<HandleReading, kMaxTrackerCoils> newest_{};
};

}  // namespace tubed::aurora
