// At which rate does the tracker listen? What is tried, in which order.
#pragma once

#include <chrono>
#include <cstddef>

#include "drivers/aurora/rate_choice.hpp"

namespace tubed::aurora {

/// One thing to try: set the rate, send a break if asked for, then say INIT again and again for as long as
/// said.
struct SearchStep {
  BaudRate rate = BaudRate::k9600;
  bool serial_break = false;
  std::chrono::milliseconds timeout{};
};

/// After power-on and after a break a tracker listens at 9600 baud. A client that crashed has left it at the
/// rate it tracked at. A break brings it back wherever it was, unless line or adapter swallow it: then all
/// rates are tried.
///
/// A tracker that is not there is waited for: it comes back at the likely rate when only its cable was out,
/// at 9600 when it was switched on, so that both are tried twice a second whatever else is. A break then
/// comes seldom: it would reset one that has just come back. One thread; no allocation.
class LinkSearch {
 public:
  /// Time between two INIT: it was answered after 50 ms.
  static constexpr std::chrono::milliseconds kBetweenTries{200};

  /// The tracker's state is not known.
  void begin(BaudRate likely) noexcept {
    likely_ = likely;
    at_ = 0;
    waiting_ = false;
  }
  /// The tracker has fallen silent at `rate`: it may have lost only its cable, or power.
  void begin_after_loss(BaudRate rate) noexcept {
    likely_ = rate;
    at_ = 0;
    waiting_ = true;
    waits_ = kFirstWaits;
  }

  [[nodiscard]] SearchStep step() const noexcept;
  /// Goes to the next step; false when all have been tried, and goes on waiting.
  bool advance() noexcept;

 private:
  [[nodiscard]] SearchStep first_step() const noexcept;
  [[nodiscard]] SearchStep waiting_step() const noexcept;

  static constexpr std::size_t kFirstWaits = 40;   ///< steps, 8 s: until a break is sent
  static constexpr std::size_t kLaterWaits = 300;  ///< a minute

  BaudRate likely_ = BaudRate::k115200;
  std::size_t at_ = 0;
  std::size_t waits_ = kFirstWaits;
  bool waiting_ = false;
};

}  // namespace tubed::aurora
