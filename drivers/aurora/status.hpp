// Status words of an Aurora. Only single bits mean something: other bits are set in real devices and differ
// between them, so that a status is never compared as a number. Any thread; no state.
#pragma once

#include <cstdint>

namespace tubed::aurora {

/// State of one port handle.
struct PortStatus {
  std::uint32_t bits = 0;

  [[nodiscard]] constexpr bool occupied() const noexcept { return bit(0); }
  [[nodiscard]] constexpr bool initialised() const noexcept { return bit(4); }
  [[nodiscard]] constexpr bool enabled() const noexcept { return bit(5); }
  [[nodiscard]] constexpr bool out_of_volume() const noexcept { return bit(6); }
  [[nodiscard]] constexpr bool partly_out_of_volume() const noexcept { return bit(7); }
  [[nodiscard]] constexpr bool coil_broken() const noexcept { return bit(8); }
  [[nodiscard]] constexpr bool processing_exception() const noexcept { return bit(12); }

 private:
  [[nodiscard]] constexpr bool bit(unsigned number) const noexcept { return (bits >> number & 1U) != 0; }
};

/// State of the whole tracker.
struct SystemStatus {
  std::uint16_t bits = 0;

  [[nodiscard]] constexpr bool synchronisation_error() const noexcept { return bit(0); }
  [[nodiscard]] constexpr bool processing_exception() const noexcept { return bit(3); }
  [[nodiscard]] constexpr bool port_became_occupied() const noexcept { return bit(6); }
  [[nodiscard]] constexpr bool port_became_unoccupied() const noexcept { return bit(7); }
  [[nodiscard]] constexpr bool diagnostic_pending() const noexcept { return bit(8); }
  [[nodiscard]] constexpr bool temperature_out_of_range() const noexcept { return bit(9); }
  [[nodiscard]] constexpr bool hardware_changed() const noexcept { return bit(10); }

 private:
  [[nodiscard]] constexpr bool bit(unsigned number) const noexcept {
    return (static_cast<unsigned>(bits) >> number & 1U) != 0;
  }
};

}  // namespace tubed::aurora
