// The rate to track at: the fastest that both ends can, and not faster than asked for.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/aurora/command.hpp"

namespace tubed::aurora {

/// The rates that trackers have, the fastest first.
inline constexpr std::array<BaudRate, 8> kRates = {BaudRate::k921600, BaudRate::k230400, BaudRate::k115200,
                                                   BaudRate::k57600,  BaudRate::k38400,  BaudRate::k19200,
                                                   BaudRate::k14400,  BaudRate::k9600};

/// One thread; no allocation.
class RateChoice {
 public:
  /// `wanted`: the rate to track at.
  explicit RateChoice(BaudRate wanted) noexcept : wanted_(wanted) {}

  /// The fastest that is not faster than wanted and has not been refused; 9600 always remains.
  [[nodiscard]] BaudRate best() const noexcept;
  /// The host or the tracker does not have it, or nothing was heard at it.
  void refuse(BaudRate rate) noexcept;
  /// Another host's port: everything may be tried again.
  void forget() noexcept { refused_ = 0; }
  [[nodiscard]] BaudRate wanted() const noexcept { return wanted_; }

 private:
  BaudRate wanted_;
  std::uint32_t refused_ = 0;  ///< bits, by place in the list of rates
};

}  // namespace tubed::aurora
