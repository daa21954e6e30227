#include "daemon/image/mask_cover.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace tubed {

namespace {

constexpr int kAlong_px = 8;  // to either side, of the mean along a mask's side
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

}  // namespace

MaskCover::MaskCover(const CameraCalibration& camera)
    : width_(camera.width), height_(camera.height), masks_(masks_of(camera)) {
  const auto longest = static_cast<std::size_t>(std::max({width_, height_, 1}));
  for (Side* const side : {&left_, &right_, &above_, &below_}) {
    side->values.resize(longest);
  }
  raw_.resize(longest);
}

bool MaskCover::is_covered(int column, int row) const {
  return std::any_of(masks_.begin(), masks_.end(),
                     [=](const ImageMask& mask) { return mask.contains(column, row); });
}

/// Means of the first `count` raw_ over their neighbours, without what another mask covers. A side of which
/// nothing is left is none.
void MaskCover::smooth(int count, Side& side) {
  side.is_there = false;
  for (int i = 0; i < count; ++i) {
    float sum = 0;
    int known = 0;
    for (int k = std::max(0, i - kAlong_px); k <= std::min(count - 1, i + kAlong_px); ++k) {
      const float value = raw_[static_cast<std::size_t>(k)];
      sum += std::isnan(value) ? 0 : value;
      known += std::isnan(value) ? 0 : 1;
    }
    side.values[static_cast<std::size_t>(i)] = known > 0 ? sum / static_cast<float>(known) : kNothing;
    side.is_there = side.is_there || known > 0;
  }
}

template <typename Pixel>
void MaskCover::read_column(const ImageMask& mask, int column, const Pixel* pixels, Side& side) {
  if (column < 0 || column >= width_) {
    side.is_there = false;
    return;
  }
  for (int i = 0; i < mask.height; ++i) {
    const int row = mask.y + i;
    raw_[static_cast<std::size_t>(i)] =
        is_covered(column, row)
            ? kNothing
            : static_cast<float>(pixels[static_cast<std::ptrdiff_t>(row) * width_ + column]);
  }
  smooth(mask.height, side);
}

template <typename Pixel>
void MaskCover::read_row(const ImageMask& mask, int row, const Pixel* pixels, Side& side) {
  if (row < 0 || row >= height_) {
    side.is_there = false;
    return;
  }
  for (int i = 0; i < mask.width; ++i) {
    const int column = mask.x + i;
    raw_[static_cast<std::size_t>(i)] =
        is_covered(column, row)
            ? kNothing
            : static_cast<float>(pixels[static_cast<std::ptrdiff_t>(row) * width_ + column]);
  }
  smooth(mask.width, side);
}

template <typename Pixel>
void MaskCover::cover_mask(const ImageMask& mask, Pixel* pixels) {
  read_column(mask, mask.x - 1, pixels, left_);
  read_column(mask, mask.x + mask.width, pixels, right_);
  read_row(mask, mask.y - 1, pixels, above_);
  read_row(mask, mask.y + mask.height, pixels, below_);
  for (int row = 0; row < mask.height; ++row) {
    for (int column = 0; column < mask.width; ++column) {
      float sum = 0;
      float weights = 0;
      const auto add = [&](const Side& side, int along, int distance_px) {
        const float value = side.is_there ? side.values[static_cast<std::size_t>(along)] : kNothing;
        if (!std::isnan(value)) {
          sum += value / static_cast<float>(distance_px);
          weights += 1 / static_cast<float>(distance_px);
        }
      };
      add(left_, row, column + 1);
      add(right_, row, mask.width - column);
      add(above_, column, row + 1);
      add(below_, column, mask.height - row);
      pixels[static_cast<std::ptrdiff_t>(mask.y + row) * width_ + mask.x + column] =
          static_cast<Pixel>(weights > 0 ? std::lround(sum / weights) : 0);
    }
  }
}

void MaskCover::cover(ImageFrame& frame) {
  const std::size_t count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  const bool has_pixels = frame.fluoroscopy_on && frame.width == width_ && frame.height == height_ &&
                          frame.pixels.size() >= count * (frame.depth == PixelDepth::kGrey8 ? 1 : 2);
  if (!has_pixels) {
    return;
  }
  for (const ImageMask& mask : masks_) {
    if (frame.depth == PixelDepth::kGrey8) {
      cover_mask(mask, frame.pixels.data());
    } else {
      cover_mask(mask, reinterpret_cast<std::uint16_t*>(frame.pixels.data()));
    }
  }
}

}  // namespace tubed
