// What a gateway says of itself and its tracker. Any thread; no state.
#pragma once

#include <cstdint>
#include <string_view>

#include "drivers/aurora/status.hpp"

namespace tubed::aurora {

/// Why there is no measurement: bits 0 to 6 of the gateway error. Other numbers are of gateways to come.
enum class CanTrackerState : std::uint8_t {
  kMeasuring = 0,
  kNoPort = 1,        ///< the gateway cannot open its serial port, or has lost it
  kNoTracker = 2,     ///< nothing answers at the serial port
  kStarting = 3,      ///< the tracker answers; rate, ports and tracking are being set up
  kNotMeasuring = 4,  ///< the tracker answers, but has not measured for a second
  kGatewayEnds = 5    ///< the gateway was stopped: the last that is heard of it
};

/// The same in words, without a subject: "cannot ...". The text is constant.
[[nodiscard]] std::string_view describe(CanTrackerState state) noexcept;

/// State of tracker and gateway, at least once a second and when it changes.
struct CanStatus {
  static constexpr std::uint8_t kProtocol = 0x10;
  /// Bit of gateway_error: the tracker is an emulated one. Says something only while it measures.
  static constexpr std::uint8_t kSimulated = 0x80;

  std::uint8_t protocol = kProtocol;
  int coil_count = 0;  ///< 0 while there are no measurements
  SystemStatus system_status;
  std::uint16_t ports_present = 0;  ///< bit p - 1: something is plugged in at port p
  std::uint8_t gateway_error = 0;   ///< a CanTrackerState, and kSimulated

  [[nodiscard]] constexpr CanTrackerState tracker_state() const noexcept {
    return static_cast<CanTrackerState>(gateway_error & ~kSimulated);
  }
  [[nodiscard]] constexpr bool is_measuring() const noexcept {
    return tracker_state() == CanTrackerState::kMeasuring;
  }
  [[nodiscard]] constexpr bool is_simulated() const noexcept { return (gateway_error & kSimulated) != 0; }
};

}  // namespace tubed::aurora
