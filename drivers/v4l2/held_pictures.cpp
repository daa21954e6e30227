#include "drivers/v4l2/held_pictures.hpp"

#include <algorithm>
#include <utility>

namespace tubed {

namespace {

// Without noise of the capture: more than one pixel of a block that differs by one level.
constexpr double kMinSquares = 1.5;

/// Where block `index` of `count` begins, spread evenly over `side` pixels.
long corner_of(int index, int count, int side, int block) {
  return count < 2 ? (side - block) / 2 : static_cast<long>(index) * (side - block) / (count - 1);
}

}  // namespace

// The difference of two captures of one picture has the variance 2 sigma^2; its mean over the 64 pixels of a
// block scatters by 2 sigma^2 sqrt(2 / 64): (3 sigma)^2 is 20 of these standard deviations above.
HeldPictures::HeldPictures(double noise_levels, std::vector<ImageMask> masks)
    : masks_(std::move(masks)),
      limit_(std::max(9 * noise_levels * noise_levels * kBlock * kBlock, kMinSquares)),
      before_(static_cast<std::size_t>(kBlocksASide * kBlocksASide * kBlock * kBlock)) {}

void HeldPictures::begin(PictureSize size, PixelDepth depth) noexcept {
  size_ = size;
  depth_ = depth;
  across_ = std::min(size.width / kBlock, kBlocksASide);
  down_ = std::min(size.height / kBlock, kBlocksASide);
  has_one_ = false;
}

bool HeldPictures::is_new(std::span<const std::uint8_t> pixels) noexcept {
  // The buffer of a frame comes from operator new: aligned for every type.
  return depth_ == PixelDepth::kGrey8 ? compare(pixels.data())
                                      : compare(reinterpret_cast<const std::uint16_t*>(pixels.data()));
}

template <typename Pixel>
bool HeldPictures::compare(const Pixel* pixels) noexcept {
  int changed = 0;
  int asked = 0;
  std::uint16_t* before = before_.data();
  for (int row = 0; row < down_; ++row) {
    const long y = corner_of(row, down_, size_.height, kBlock);
    for (int column = 0; column < across_; ++column, before += kBlock * kBlock) {
      const long x = corner_of(column, across_, size_.width, kBlock);
      if (is_asked(x, y)) {
        ++asked;
        changed += take_block(pixels + y * size_.width + x, before) ? 1 : 0;
      }
    }
  }
  const bool is_first = !std::exchange(has_one_, true);
  return is_first || 20 * changed >= asked;
}

bool HeldPictures::is_asked(long x, long y) const noexcept {
  return std::none_of(masks_.begin(), masks_.end(), [=](const ImageMask& mask) {
    return x < mask.x + mask.width && x + kBlock > mask.x && y < mask.y + mask.height && y + kBlock > mask.y;
  });
}

/// True: it has changed. `before` becomes this one.
template <typename Pixel>
bool HeldPictures::take_block(const Pixel* corner, std::uint16_t* before) const noexcept {
  double squares = 0;
  for (int y = 0; y < kBlock; ++y, corner += size_.width, before += kBlock) {
    for (int x = 0; x < kBlock; ++x) {
      const int difference = static_cast<int>(corner[x]) - static_cast<int>(before[x]);
      squares += static_cast<double>(difference) * difference;
      before[x] = corner[x];
    }
  }
  return squares > limit_;
}

}  // namespace tubed
