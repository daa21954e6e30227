// The pixels of a sequence folder: 8- and 16-bit grey PNG.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

/// A grey picture as ImageFrame carries it: row by row, no padding, 16 bit in host order.
struct GreyImage {
  int width = 0;   ///< px
  int height = 0;  ///< px
  PixelDepth depth = PixelDepth::kGrey8;
  std::vector<std::uint8_t> pixels;
};

/// Decodes the picture of a frame. Precondition: frame.fluoroscopy_on(). Throws SequenceError (at the frame's
/// row) for a missing or broken file, a colour picture, and another size than its camera's; the size is
/// checked before the pixels are decoded.
GreyImage read_image(const Sequence& sequence, const SequenceFrame& frame);

/// A picture as the bytes of a PNG file, from any thread.
std::vector<std::uint8_t> encode_image(const GreyImage& image);

/// Writes a picture as PNG. Throws SequenceError when that fails.
void write_image(const std::filesystem::path& file, const GreyImage& image);

}  // namespace tubed
