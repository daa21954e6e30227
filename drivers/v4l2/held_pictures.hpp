// Is a picture a new exposure, or the one before shown once more? Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/v4l2/picture_shape.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

/// A console shows 60 pictures a second of which 7.5 are new (pulsed fluoroscopy), and goes on showing the
/// last one when the pedal is up (last image hold). Two exposures of the same scene differ by their quantum
/// noise, which never repeats; a picture shown again differs by the noise of the capture alone, none with a
/// digital signal.
///
/// Blocks of 8 x 8 pixels spread over the picture are compared with those of the picture before. A block has
/// changed when the mean of its squared differences is above (3 sigma)^2, sigma being the noise of the
/// capture; under a new exposure it is twice the variance of the quantum noise, and more where something
/// moves. A picture is new when one block in twenty has changed: shutters and saturated areas have no noise,
/// and a clock or a cursor that goes on is no exposure. Blocks that a mask touches are not asked.
///
/// One thread. Nothing but the constructor allocates.
class HeldPictures {
 public:
  /// `noise_levels`: sigma, grey levels of one picture's pixel, of the pictures compared.
  /// `masks`: of the pictures compared.
  explicit HeldPictures(double noise_levels, std::vector<ImageMask> masks = {});

  /// Pictures of this size will come; the next one is new.
  void begin(PictureSize size, PixelDepth depth) noexcept;
  /// `pixels`: row by row, no padding, 16 bit in host order. True: it is a new exposure. It is the one that
  /// the next is compared with, new or not.
  bool is_new(std::span<const std::uint8_t> pixels) noexcept;

 private:
  static constexpr int kBlock = 8;         // px
  static constexpr int kBlocksASide = 24;  // at most

  template <typename Pixel>
  bool compare(const Pixel* pixels) noexcept;
  template <typename Pixel>
  bool take_block(const Pixel* corner, std::uint16_t* before) const noexcept;

  [[nodiscard]] bool is_asked(long x, long y) const noexcept;

  std::vector<ImageMask> masks_;
  double limit_;  ///< of the sum of squared differences of a block
  PictureSize size_;
  PixelDepth depth_ = PixelDepth::kGrey8;
  int across_ = 0;  ///< blocks
  int down_ = 0;
  bool has_one_ = false;
  std::vector<std::uint16_t> before_;
};

}  // namespace tubed
