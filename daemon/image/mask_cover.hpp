// Covers what of a camera's images shows no X-rays, before anything else sees it.
#pragma once

#include <vector>

#include "drivers/interface/image_source.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

/// Replaces masked pixels by what lies around them: at each of them the mean of the four values at the
/// mask's sides, in its row and its column, weighted by one over their distances; a value is a mean along
/// that side, because noise that is drawn out looks like a ridge. So a clock that runs does not hide a frozen
/// image, white letters set no white level, and a name in the picture goes no further than this. Covering an
/// image twice is the same as once. Used by one thread; never allocates after construction.
class MaskCover {
 public:
  /// `camera`: the size and the masks of its images as they come.
  explicit MaskCover(const CameraCalibration& camera);

  /// A frame of another size, or without pixels, is left alone.
  void cover(ImageFrame& frame);

 private:
  /// One side of a mask: the smoothed values beside it; `is_there`: it is not the image's border.
  struct Side {
    std::vector<float> values;
    bool is_there = false;
  };

  template <typename Pixel>
  void cover_mask(const ImageMask& mask, Pixel* pixels);
  template <typename Pixel>
  void read_column(const ImageMask& mask, int column, const Pixel* pixels, Side& side);
  template <typename Pixel>
  void read_row(const ImageMask& mask, int row, const Pixel* pixels, Side& side);
  void smooth(int count, Side& side);
  [[nodiscard]] bool is_covered(int column, int row) const;

  int width_;
  int height_;
  std::vector<ImageMask> masks_;
  Side left_, right_, above_, below_;
  std::vector<float> raw_;  ///< along a side; NaN where another mask is
};

}  // namespace tubed
