// How the clock of a gateway lies to ours: learned from the frames that came soonest.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// The gateway knows when the tracker measured, by its own clock (it fits the frame numbers, see
/// aurora::FrameClock), and says so in every SYNC, in microseconds that wrap after 71.6 minutes. A frame that
/// was sent at time s of that clock and received at time r of ours proves that the two differ by no more than
/// r - s; the smallest of these within 4 s is the difference. Two crystals drift apart by 0.2 ms in that
/// time.
///
/// One thread; no clock, no allocation.
class GatewayClock {
 public:
  /// What was sent at `sent_us` was received at `received`.
  void observe(std::uint32_t sent_us, MonotonicTime received) noexcept;

  /// Our time of `time_us`, said by a SYNC that was received at `received`. A result after `received` or more
  /// than kMaxDelay before it is not believed (the gateway was restarted, or has no clock): then this is
  /// `received`, and everything begins anew.
  [[nodiscard]] MonotonicTime at(std::uint32_t time_us, MonotonicTime received) noexcept;

  void reset() noexcept { known_ = false; }
  /// Times that what a gateway said was not believed.
  [[nodiscard]] std::uint64_t disbelieved() const noexcept { return disbelieved_; }

  static constexpr std::chrono::milliseconds kMaxDelay{250};

 private:
  static constexpr std::size_t kBuckets = 8;
  static constexpr std::chrono::milliseconds kBucket{500};

  [[nodiscard]] std::int64_t unwrapped_ns(std::uint32_t time_us) const noexcept;
  [[nodiscard]] std::int64_t min_difference_ns() const noexcept;

  bool known_ = false;
  std::uint32_t last_us_ = 0;  ///< newest that was observed,
  std::int64_t last_ns_ = 0;   ///< and the same, unwrapped
  std::array<std::int64_t, kBuckets> min_ns_{};
  std::size_t bucket_ = 0;
  MonotonicTime bucket_ends_{};
  std::uint64_t disbelieved_ = 0;
};

}  // namespace tubed
