// When it is worth stopping tracking to look at the ports.
#pragma once

#include "drivers/aurora/status.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

/// The ports can only be initialised while nothing is tracked, so that they are looked at only when a coil of
/// the configuration is absent and something has been plugged in since. When that did not help, the next look
/// waits: 2 s, then twice as long each time, 5 minutes at most. One thread; no allocation.
class PlugWatch {
 public:
  /// What one reply says about plugs.
  struct Sight {
    bool coil_absent = false;  ///< a coil of the configuration is not there
    bool newcomer = false;     ///< a handle that the port setup did not meet
    SystemStatus status = {};
  };

  /// Tracking has begun.
  void start() noexcept { occupied_known_ = became_occupied_ = false; }
  /// True: the ports should be initialised again.
  bool look(const Sight& sight, MonotonicTime now) noexcept;

 private:
  bool occupied_bit_ = false;
  bool occupied_known_ = false;
  bool became_occupied_ = false;  ///< since the last look
  MonotonicTime not_before_{};
  std::chrono::nanoseconds wait_ = std::chrono::seconds(2);
};

}  // namespace tubed::aurora
