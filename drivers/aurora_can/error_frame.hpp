// What a CAN controller reports in an error frame.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace tubed {

/// One error frame. Any thread; no state.
struct CanTrouble {
  bool bus_off = false;           ///< the controller has left the bus
  bool restarted = false;         ///< and has joined it again
  bool passive = false;           ///< so many errors that it no longer interrupts the others
  bool warning = false;           ///< many errors
  bool receive_overflow = false;  ///< the controller lost frames before the kernel had them
  bool no_acknowledgement = false;
  bool protocol_violation = false;  ///< damaged bits: cable, termination, or another bit rate
};

/// `id`: can_id of the frame, with CAN_ERR_FLAG; `bytes`: its eight bytes (fewer are taken for zeros).
[[nodiscard]] CanTrouble read_error_frame(std::uint32_t id, std::span<const std::uint8_t> bytes) noexcept;

/// What a person should look at: the gravest of it, in words without a subject. The text is constant.
[[nodiscard]] std::string_view describe(const CanTrouble& trouble) noexcept;

}  // namespace tubed
