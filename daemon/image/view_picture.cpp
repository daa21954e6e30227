#include "daemon/image/view_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace tubed {

namespace {

constexpr int kMinSide = 64;          // px
constexpr int kReducedSide = 200;     // px: the short side is not reduced below
constexpr double kHighPassSigma = 6;  // reduced px: what is larger is brightness
constexpr double kSpreadSigma = 12;   // reduced px: where contrast is measured
constexpr float kSpreadFloor = 1;     // grey levels of 255: noise is not blown up to texture
constexpr float kMinWeight = 1e-3F;
constexpr float kSmall = 0.2414F;  // taps of a Gaussian of 0.8 px cut at one pixel: 0.2414, 0.5172, 0.2414

int factor_for(int width, int height) {
  if (std::min(width, height) < kMinSide) {
    throw std::invalid_argument("a view is watched in images of 64 x 64 pixels or more");
  }
  return std::max(1, std::min(width, height) / kReducedSide);
}

/// Sums of `factor` neighbours, times `share`.
void sum_neighbours(const std::uint32_t* sums, int factor, float share, Eigen::Index count, float* to) {
  if (factor == 1) {
    for (Eigen::Index i = 0; i < count; ++i) to[i] = static_cast<float>(static_cast<int>(sums[i])) * share;
  } else if (factor == 2) {
    for (Eigen::Index i = 0; i < count; ++i) {
      to[i] = static_cast<float>(static_cast<int>(sums[2 * i] + sums[2 * i + 1])) * share;
    }
  } else {
    for (Eigen::Index i = 0; i < count; ++i, sums += factor) {
      std::uint32_t sum = sums[0];
      for (int k = 1; k < factor; ++k) sum += sums[k];
      to[i] = static_cast<float>(static_cast<int>(sum)) * share;
    }
  }
}

}  // namespace

float ViewPicture::open_share() const {
  int count = 0;
  for (Eigen::Index i = 0; i < open.size(); ++i) count += open.data()[i];
  return open.size() == 0 ? 0 : static_cast<float>(count) / static_cast<float>(open.size());
}

ViewReducer::ViewReducer(int width, int height)
    : width_(width),
      factor_(factor_for(width, height)),
      mean_(PixelGrid::Zero(height / factor_, width / factor_)),
      contrast_(mean_),
      large_(mean_),
      open_(mean_),
      over_small_(mean_),
      over_large_(mean_),
      over_spread_(mean_),
      weighed_(OpenGrid::Zero(mean_.rows(), mean_.cols())),
      blades_(mean_.rows(), mean_.cols()),
      large_blur_(mean_.rows(), mean_.cols(), kHighPassSigma),
      spread_blur_(mean_.rows(), mean_.cols(), kSpreadSigma),
      column_sums_(static_cast<std::size_t>(width)),
      three_rows_(mean_.cols()) {}

ViewPicture ViewReducer::picture() const {
  return {TextureGrid::Zero(rows(), columns()), OpenGrid::Zero(rows(), columns())};
}

void ViewReducer::reduce(const ImageFrame& frame, float white_level, ViewPicture& picture) {
  const float scale = 255 / white_level;
  if (frame.depth == PixelDepth::kGrey8) {
    average(frame.pixels.data(), scale);
  } else {
    average(reinterpret_cast<const std::uint16_t*>(frame.pixels.data()), scale);
  }
  blades_.find(mean_, picture.open);
  weigh(picture.open);
  high_pass();
  write_texture(picture.texture);
}

template <typename Pixel>
void ViewReducer::average(const Pixel* pixels, float scale) {
  const float share = scale / static_cast<float>(factor_ * factor_);
  const Eigen::Index used = columns() * factor_;
  std::uint32_t* const sums = column_sums_.data();
  for (Eigen::Index row = 0; row < rows(); ++row) {
    const Pixel* from = pixels + row * factor_ * width_;
    for (Eigen::Index i = 0; i < used; ++i) sums[i] = from[i];
    for (int y = 1; y < factor_; ++y) {
      from += width_;
      for (Eigen::Index i = 0; i < used; ++i) sums[i] += from[i];
    }
    sum_neighbours(sums, factor_, share, columns(), &mean_(row, 0));
  }
}

/// The weights of an opening, which seldom changes.
void ViewReducer::weigh(const OpenGrid& open) {
  if (std::memcmp(open.data(), weighed_.data(), static_cast<std::size_t>(open.size())) == 0) return;
  weighed_ = open;
  open_ = open.cast<float>();
  smooth(open_, over_small_);
  over_large_ = over_spread_ = open_;
  large_blur_.apply(over_large_);
  spread_blur_.apply(over_spread_);
  for (PixelGrid* const weights : {&over_small_, &over_large_, &over_spread_}) {
    *weights = open_ / weights->max(kMinWeight);
  }
}

/// 3 x 3 taps; the border keeps its own value.
void ViewReducer::smooth(const PixelGrid& from, PixelGrid& to) {
  constexpr float kMiddle = 1 - 2 * kSmall;
  const Eigen::Index h = from.rows() - 2;
  const Eigen::Index w = from.cols() - 2;
  to.row(0) = from.row(0);
  to.row(h + 1) = from.row(h + 1);
  for (Eigen::Index row = 1; row <= h; ++row) {
    three_rows_ = kSmall * (from.row(row - 1) + from.row(row + 1)) + kMiddle * from.row(row);
    to.row(row).segment(1, w) = kSmall * (three_rows_.segment(0, w) + three_rows_.segment(2, w)) +
                                kMiddle * three_rows_.segment(1, w);
    to(row, 0) = from(row, 0);
    to(row, w + 1) = from(row, w + 1);
  }
}

/// contrast_ and, in large_, its local variance.
void ViewReducer::high_pass() {
  mean_ *= open_;
  smooth(mean_, contrast_);
  large_ = mean_;
  large_blur_.apply(large_);
  contrast_ = contrast_ * over_small_ - large_ * over_large_;
  large_ = contrast_.square();
  spread_blur_.apply(large_);
}

/// Over the local standard deviation, so that gain and window do not matter.
void ViewReducer::write_texture(TextureGrid& texture) {
  constexpr float kUnit = kTextureUnit;
  constexpr float kMax = kMaxTexture * kTextureUnit;
  large_ =
      (kUnit * contrast_ / ((large_ * over_spread_).max(0.0F).sqrt() + kSpreadFloor)).max(-kMax).min(kMax);
  // Rounded to the nearest; what is clipped keeps its sign.
  const float* const from = large_.data();
  for (Eigen::Index i = 0; i < texture.size(); ++i) {
    texture.data()[i] =
        static_cast<std::int16_t>(static_cast<int>(from[i] + kMax + 0.5F) - static_cast<int>(kMax));
  }
}

}  // namespace tubed
