// Wakes a sleeping stage: one futex word that counts rings. Modelled in tests/models/doorbell.pml.
#pragma once

#include <atomic>
#include <cstdint>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Any thread rings; exactly one thread waits. A ring between two waits is never lost: wait() returns at once
/// when the count has moved since its last return. ring() makes a system call only while somebody sleeps.
class Doorbell {
 public:
  /// Any thread; never waits.
  void ring() noexcept;

  /// The waiting thread: sleeps until a ring or `deadline` (CLOCK_MONOTONIC). True when it was rung.
  bool wait_until(MonotonicTime deadline) noexcept;

 private:
  std::atomic<std::uint32_t> count_{0};
  std::atomic<std::uint32_t> sleepers_{0};
  std::uint32_t seen_ = 0;  ///< of the waiting thread alone
};

/// Tells a thread to end. Set by any thread, read by any thread. Hands nothing over: the thread that sets it
/// then wakes the other by a Doorbell, whose memory orders make the flag visible, and joins it.
class StopFlag {
 public:
  void set() noexcept { set_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool is_set() const noexcept { return set_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> set_{false};
};

}  // namespace tubed
