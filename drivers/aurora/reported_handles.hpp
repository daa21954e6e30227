// Which handles a reply reports, beside those that are tracked.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>

#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

/// An Aurora reports every handle that it has allocated, in TX and in BX: those that are not enabled as
/// DISABLED, those whose tool is gone as UNOCCUPIED (TX) or DISABLED (BX). One thread; no allocation.
class ReportedHandles {
 public:
  enum class Agreement {
    kComplete,        ///< every tracked handle once; whatever else is there is not enabled
    kForeignEnabled,  ///< every tracked handle once, and another one that is enabled as well
    kTrackedAbsent,   ///< a tracked handle is not there
    kTwice            ///< a handle is there twice: no tracker says that
  };

  /// Tracking has begun: `tracked` are enabled, `found` are all handles that the port setup met.
  void start(std::span<const std::uint8_t> tracked, std::span<const std::uint8_t> found) noexcept;
  /// Compares a reply with what is tracked and takes note of the other handles.
  Agreement compare(const TrackingReply& reply) noexcept;

  /// What the newest reply reported, in its order.
  [[nodiscard]] std::span<const std::uint8_t> reported() const noexcept { return {reported_.data(), count_}; }
  [[nodiscard]] std::span<const std::uint8_t> tracked() const noexcept {
    return {tracked_.data(), tracked_count_};
  }
  /// The first handle of the newest reply that the port setup did not meet: a tool has been plugged in since.
  /// -1: there is none.
  [[nodiscard]] int newcomer() const noexcept { return newcomer_; }

 private:
  using Set = std::bitset<256>;  // by handle

  Set is_tracked_;
  Set is_known_;
  std::array<std::uint8_t, kMaxHandles> tracked_{};
  std::size_t tracked_count_ = 0;
  std::array<std::uint8_t, kMaxHandles> reported_{};
  std::size_t count_ = 0;
  int newcomer_ = -1;
};

}  // namespace tubed::aurora
