// Pictures as PNG files, by libpng: the one place that reads and writes them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace tubed {

/// What one pixel is: 8 or 16 bit of grey, or 8 bit each of red, green and blue.
enum class PixelLayout { kGrey8, kGrey16, kRgb8 };

/// Bytes of a pixel in memory.
constexpr std::size_t bytes_per_pixel(PixelLayout layout) {
  return layout == PixelLayout::kGrey8 ? 1 : layout == PixelLayout::kGrey16 ? 2 : 3;
}

/// What a file says of itself before its pixels.
struct PngHeader {
  std::int64_t width = 0;             ///< px
  std::int64_t height = 0;            ///< px
  std::optional<PixelLayout> layout;  ///< empty for the others that PNG knows: a palette, alpha, 1 bit ...
};

/// A picture in memory, row by row without padding; 16 bit in host order.
template <typename Byte>
struct PictureBytes {
  int width = 0;   ///< px
  int height = 0;  ///< px
  PixelLayout layout = PixelLayout::kGrey8;
  std::span<Byte> pixels;  ///< width * height * bytes_per_pixel(layout) bytes
};

/// kFast looks for runs of one value alone: noise has no other repetitions, and they cost time; kSmall suits
/// drawings.
enum class PngCompression { kFast, kSmall };

/// Its words follow the name of a file: "is missing or cannot be read".
class PngError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads the first bytes of a file. Throws PngError when there is no such file, or it is not a PNG.
PngHeader read_png_header(const std::filesystem::path& file);

/// Decodes a file into `picture`, whose size and layout are those of its header. Throws PngError for a file
/// that is damaged or cut off, and for one of another size or layout; the pixels are undefined then.
/// Precondition: the span has the size of the picture.
void read_png(const std::filesystem::path& file, const PictureBytes<std::uint8_t>& picture);

/// The bytes of a file. Throws PngError where memory is short. Precondition: as read_png().
std::vector<std::uint8_t> encode_png(const PictureBytes<const std::uint8_t>& picture,
                                     PngCompression compression);

/// Writes a file. Throws PngError when that fails; what was written by then stays. Precondition: as
/// read_png().
void write_png(const std::filesystem::path& file, const PictureBytes<const std::uint8_t>& picture,
               PngCompression compression);

}  // namespace tubed
