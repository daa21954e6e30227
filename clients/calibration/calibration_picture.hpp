// A grey picture as measurements are taken from it.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <vector>

namespace tubed {

/// A picture, a phantom or what was found on them cannot be used; says which, what is wrong and what to do.
class PhantomError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Row by row; the centre of the first pixel is (0, 0).
struct CalibrationPicture {
  std::string name;  ///< for messages
  int width = 0;     ///< px
  int height = 0;    ///< px
  std::vector<float> pixels;

  [[nodiscard]] float at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  /// As it looks from the other side: each row read from right to left.
  [[nodiscard]] CalibrationPicture mirrored() const;
  /// Part of all pixels that have the picture's least or greatest value, whichever is more: saturated, or cut
  /// off by a window.
  [[nodiscard]] double clipped_share() const;
};

/// Reads a PNG of 8 or 16 bit grey. Throws PhantomError.
CalibrationPicture read_calibration_picture(const std::filesystem::path& file);

/// From pixels as drivers/png has them, 8 or 16 bit in host order.
CalibrationPicture calibration_picture(std::string name, int width, int height,
                                       const std::vector<std::uint8_t>& bytes);

}  // namespace tubed
