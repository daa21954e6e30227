// How long frames keep a CAN bus busy, from their bits.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/aurora/can_frames.hpp"

namespace tubed {

/// Bit rates of a bus. Of classic frames and the arbitration of FD frames; of the data of FD frames.
struct CanRates {
  double nominal_bits_per_second = 500'000;
  double data_bits_per_second = 2'000'000;
};

/// Bits of one frame, as many stuff bits as there can be, and the pause behind it
/// (ISO 11898-1:2015). A classic frame of 8 bytes with an identifier of 11 bits
/// has 135.
struct CanFrameBits {
  int nominal = 0;
  int data = 0;  ///< sent at the data rate: of FD frames only

  [[nodiscard]] double seconds(const CanRates& rates) const noexcept;
};

/// `size` in bytes: up to 8 is a classic frame, more is FD with bit rate switch (of a length that FD has).
[[nodiscard]] CanFrameBits max_frame_bits(
    int size, aurora::CanIdentifierSize identifier = aurora::CanIdentifierSize::kStandard) noexcept;

/// Time that `frames` keep the bus busy, at the most, s.
[[nodiscard]] double bus_seconds(std::span<const aurora::CanFrame> frames, const CanRates& rates) noexcept;

}  // namespace tubed
