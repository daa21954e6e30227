// Images of the fluoroscope as a person looks at them: 8 bit, the grey values that there are from black to
// white.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "clients/pictures/raw_image.hpp"

namespace tubed {

/// 8 bit, row by row, no padding.
struct GreyPicture {
  int width = 0;  ///< px
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

/// Which grey values of 16 bit become black and white.
struct GreyWindow {
  double black = 0;
  double white = 65535;
};

/// Between the darkest and the brightest half of a percent of every 16th pixel, at least 16 grey values, and
/// a third more to both sides.
GreyWindow window_of(std::span<const std::uint16_t> pixels);
/// So far from `from` toward `to`: pictures do not flicker with their window. `share`: 0 .. 1.
GreyWindow between(const GreyWindow& from, const GreyWindow& to, double share);
/// Linear, clamped. `to` has as many pixels.
void apply_window(std::span<const std::uint16_t> from, const GreyWindow& window, std::span<std::uint8_t> to);

/// Each second pixel and row are averaged away, until neither side is longer than `max_side`. Returns by how
/// many times it shrank: 1, 2, 4 ...
int shrink(GreyPicture& picture, int max_side);

/// Makes the pictures of one camera. Their window follows the images', so that they do not flicker.
class GreyFollower {
 public:
  /// Precondition: `image` has pixels. Valid until the next call.
  GreyPicture& take(const RawImage& image);
  /// Of the newest picture.
  [[nodiscard]] const GreyWindow& window() const { return window_; }

 private:
  GreyPicture picture_;
  GreyWindow window_;
  std::vector<std::uint16_t> deep_;
  bool has_window_ = false;
};

}  // namespace tubed
