// One row of a card's picture to grey values. Pure.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/v4l2/pixel_format.hpp"

namespace tubed {

/// Grey values of as many pixels as `grey` has, of 8-bit formats: `row` is where the first of them begins in
/// the plane with the grey values. Luma as it is; of RGB 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601, 2.5.1).
/// Precondition: `row` has that many pixels, and `format` is neither compressed nor deep.
void unpack_row(PixelFormat format, std::span<const std::uint8_t> row, std::span<std::uint8_t> grey) noexcept;

/// The same for kY10, kY12 and kY16: little-endian words (V4L2), bits above the format's cleared.
void unpack_row(PixelFormat format, std::span<const std::uint8_t> row,
                std::span<std::uint16_t> grey) noexcept;

}  // namespace tubed
