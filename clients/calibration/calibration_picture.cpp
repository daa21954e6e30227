#include "clients/calibration/calibration_picture.hpp"

#include <algorithm>
#include <cstring>

#include "drivers/png/png_file.hpp"

namespace tubed {

CalibrationPicture CalibrationPicture::mirrored() const {
  CalibrationPicture other = *this;
  for (int y = 0; y < height; ++y) {
    const auto row = other.pixels.begin() + static_cast<std::ptrdiff_t>(y) * width;
    std::reverse(row, row + width);
  }
  return other;
}

double CalibrationPicture::clipped_share() const {
  const auto [least, greatest] = std::minmax_element(pixels.begin(), pixels.end());
  const auto share_of = [&](float value) {
    return static_cast<double>(std::count(pixels.begin(), pixels.end(), value)) /
           static_cast<double>(pixels.size());
  };
  return std::max(share_of(*least), share_of(*greatest));
}

CalibrationPicture calibration_picture(std::string name, int width, int height,
                                       const std::vector<std::uint8_t>& bytes) {
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  CalibrationPicture picture{std::move(name), width, height, std::vector<float>(count)};
  if (bytes.size() == count) {
    std::copy(bytes.begin(), bytes.end(), picture.pixels.begin());
    return picture;
  }
  if (bytes.size() != 2 * count) {
    throw PhantomError(picture.name + ": has neither one nor two bytes a pixel");
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::uint16_t grey = 0;
    std::memcpy(&grey, &bytes[2 * i], 2);
    picture.pixels[i] = grey;
  }
  return picture;
}

CalibrationPicture read_calibration_picture(const std::filesystem::path& file) {
  try {
    const PngHeader header = read_png_header(file);
    if (!header.layout || *header.layout == PixelLayout::kRgb8) {
      throw PhantomError(file.string() +
                         ": is no grey picture; export 8 or 16 bit grey, as the detector has it, without "
                         "colours, alpha or text burnt in");
    }
    constexpr std::int64_t kMaxSize = 8192;
    if (header.width < 64 || header.height < 64 || header.width > kMaxSize || header.height > kMaxSize) {
      throw PhantomError(file.string() + ": is " + std::to_string(header.width) + " x " +
                         std::to_string(header.height) + " px, expected 64 to 8192 px a side");
    }
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(header.width * header.height) *
                                    bytes_per_pixel(*header.layout));
    const int width = static_cast<int>(header.width);
    const int height = static_cast<int>(header.height);
    read_png(file, {width, height, *header.layout, bytes});
    return calibration_picture(file.string(), width, height, bytes);
  } catch (const PngError& error) {
    throw PhantomError(file.string() + ": " + error.what());
  }
}

}  // namespace tubed
