// Grey pictures of the fluoroscope as a browser takes them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

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

/// libjpeg-turbo, with a buffer that is kept. One thread.
class JpegEncoder {
 public:
  /// Throws std::runtime_error.
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// The picture as JPEG, grey; valid until the next call. `quality`: 1 .. 100. Throws std::runtime_error for
  /// a picture without pixels.
  std::span<const std::uint8_t> encode(const GreyPicture& picture, int quality);

 private:
  void* encoder_;
  unsigned char* buffer_ = nullptr;
  unsigned long capacity_ = 0;
};

}  // namespace tubed
