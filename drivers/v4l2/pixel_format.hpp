// The formats of pixels that a card may deliver and this driver understands, as Linux names them (V4L2 pixel
// formats, linux/videodev2.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace tubed {

enum class PixelFormat { kY16, kY12, kY10, kGrey, kNv12, kYuyv, kUyvy, kRgb24, kBgr24, kMjpg };

/// What is known of a format.
struct PixelFormatFacts {
  PixelFormat format;
  std::uint32_t fourcc;         ///< V4L2_PIX_FMT_...
  std::string_view word;        ///< in the configuration and in messages
  int bits;                     ///< of the grey value: 8 of the 8-bit formats, else 10, 12 or 16
  std::size_t bytes_per_pixel;  ///< of the plane with the grey values; 0: compressed
};

/// All formats; a driver that may choose takes the first that the card offers: deep ones first, compressed
/// ones last.
std::span<const PixelFormatFacts> pixel_formats() noexcept;

const PixelFormatFacts& facts_of(PixelFormat format) noexcept;

/// Nothing: a format that this driver does not understand.
std::optional<PixelFormat> pixel_format_of_fourcc(std::uint32_t fourcc) noexcept;
std::optional<PixelFormat> pixel_format_of_word(std::string_view word) noexcept;

}  // namespace tubed
