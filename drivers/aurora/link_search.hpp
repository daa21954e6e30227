// At which rate does the tracker listen? What is tried, in which order.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

#include "drivers/aurora/command.hpp"

namespace tubed::aurora {

/// One thing to try: set the rate, send a break if asked for, then say INIT again and again for as long as
/// said.
struct SearchStep {
  BaudRate rate = BaudRate::k9600;
  bool serial_break = false;
  std::chrono::milliseconds patience{};
};

/// The rates that trackers have, the fastest first.
inline constexpr std::array<BaudRate, 8> kRates = {BaudRate::k921600, BaudRate::k230400, BaudRate::k115200,
                                                   BaudRate::k57600,  BaudRate::k38400,  BaudRate::k19200,
                                                   BaudRate::k14400,  BaudRate::k9600};

/// After power-on and after a break a tracker listens at 9600 baud. A client that crashed has left it at the
/// rate it tracked at. A break brings it back wherever it was, unless line or adapter swallow it: then all
/// rates are tried. One thread; no allocation.
class LinkSearch {
 public:
  /// Time between two INIT: it was answered after 50 ms.
  static constexpr std::chrono::milliseconds kBetweenTries{200};

  /// The tracker's state is not known.
  void begin(BaudRate likely) noexcept {
    likely_ = likely;
    at_ = 0;
    waits_ = 0;
    patient_ = false;
  }
  /// The tracker has fallen silent at `rate`: it may have lost power, or only its cable. It is waited for at
  /// both rates a while before anything else is tried.
  void begin_after_loss(BaudRate rate) noexcept {
    begin(rate);
    waits_ = kWaits;
    patient_ = true;
  }

  [[nodiscard]] SearchStep step() const noexcept;
  /// Goes to the next step; false when all have been tried, and begins anew.
  bool advance() noexcept;

 private:
  static constexpr std::size_t kWaits = 40;

  BaudRate likely_ = BaudRate::k115200;
  std::size_t at_ = 0;
  std::size_t waits_ = 0;
  bool patient_ = false;  ///< it is not there just now: 9600 baud is tried between the other rates
};

}  // namespace tubed::aurora
