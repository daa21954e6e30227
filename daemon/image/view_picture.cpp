#include "daemon/image/view_picture.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tubed {

namespace {

constexpr int kMinSide = 64;          // px
constexpr int kReducedSide = 200;     // px: the short side is not reduced below
constexpr double kHighPassSigma = 6;  // reduced px: what is larger is brightness
constexpr double kSpreadSigma = 12;   // reduced px: where contrast is measured
constexpr float kSpreadFloor = 1;     // grey levels of 255: noise is not blown up to texture
constexpr float kMaxTexture = 3;      // standard deviations
constexpr float kFlatShare =
    0.2F;  // of what nine tenths of the 3 x 3 reduced pixels spread less than: a blade is flatter
constexpr float kMinFlatSpread = 0.01F;    // grey levels of 255
constexpr std::size_t kSpreadStride = 17;  // every so many-th reduced pixel is looked at
constexpr Eigen::Index kBladeMargin = 2;   // reduced px around a blade that its edge still touches
constexpr float kMinWeight = 1e-3F;
constexpr float kSmall = 0.2414F;  // taps of a Gaussian of 0.8 px cut at one pixel: 0.2414, 0.5172, 0.2414

int factor_for(int width, int height) {
  if (std::min(width, height) < kMinSide) {
    throw std::invalid_argument("a view is watched in images of 64 x 64 pixels or more");
  }
  return std::max(1, std::min(width, height) / kReducedSide);
}

/// Windows of 2 r + 1 pixels, three times: variance 3 ((2 r + 1)^2 - 1) / 12.
int radius_for(double sigma_px) {
  return std::max(1, static_cast<int>(std::lround((std::sqrt(4 * sigma_px * sigma_px + 1) - 1) / 2)));
}

}  // namespace

BoxBlur::BoxBlur(Eigen::Index rows, Eigen::Index columns, double sigma_px)
    : radius_(radius_for(sigma_px)),
      between_(PixelGrid::Zero(rows, columns)),
      sums_(static_cast<std::size_t>(columns)) {}

void BoxBlur::apply(PixelGrid& values) {
  const Eigen::Index rows = values.rows();
  const Eigen::Index columns = values.cols();
  const float share = 1.0F / static_cast<float>(2 * radius_ + 1);
  for (int pass = 0; pass < 3; ++pass) {
    // Down the columns, all of a row at once: sums_ holds the window's sum of each column.
    std::fill(sums_.begin(), sums_.end(), 0.0F);
    Eigen::Map<Eigen::Array<float, 1, Eigen::Dynamic>> sums(sums_.data(), columns);
    for (Eigen::Index row = 0; row < std::min<Eigen::Index>(radius_, rows); ++row) sums += values.row(row);
    for (Eigen::Index row = 0; row < rows; ++row) {
      if (row + radius_ < rows) sums += values.row(row + radius_);
      if (row > radius_) sums -= values.row(row - radius_ - 1);
      between_.row(row) = sums * share;
    }
    for (Eigen::Index row = 0; row < rows; ++row) {
      const float* const from = between_.row(row).data();
      float* const to = values.row(row).data();
      float sum = 0;
      for (Eigen::Index column = 0; column < std::min<Eigen::Index>(radius_, columns); ++column)
        sum += from[column];
      for (Eigen::Index column = 0; column < columns; ++column) {
        if (column + radius_ < columns) sum += from[column + radius_];
        if (column > radius_) sum -= from[column - radius_ - 1];
        to[column] = sum * share;
      }
    }
  }
}

ViewReducer::ViewReducer(int width, int height)
    : width_(width),
      factor_(factor_for(width, height)),
      mean_(PixelGrid::Zero(height / factor_, width / factor_)),
      spread_(mean_),
      smooth_(mean_),
      large_(mean_),
      weights_small_(mean_),
      weights_large_(mean_),
      weights_spread_(mean_),
      last_open_(mean_),
      large_blur_(mean_.rows(), mean_.cols(), kHighPassSigma),
      spread_blur_(mean_.rows(), mean_.cols(), kSpreadSigma) {
  queue_.reserve(static_cast<std::size_t>(mean_.size()));
  some_spreads_.reserve(static_cast<std::size_t>(mean_.size()) / kSpreadStride + 1);
}

ViewPicture ViewReducer::picture() const {
  return {PixelGrid::Zero(mean_.rows(), mean_.cols()), PixelGrid::Zero(mean_.rows(), mean_.cols())};
}

void ViewReducer::reduce(const ImageFrame& frame, float white_level, ViewPicture& picture) {
  const float scale = 255 / white_level;
  if (frame.depth == PixelDepth::kGrey8) {
    average(frame.pixels.data(), scale);
  } else {
    average(reinterpret_cast<const std::uint16_t*>(frame.pixels.data()), scale);
  }
  find_blades(picture.open);
  high_pass(picture);
}

template <typename Pixel>
void ViewReducer::average(const Pixel* pixels, float scale) {
  const float share = scale / static_cast<float>(factor_ * factor_);
  for (Eigen::Index row = 0; row < mean_.rows(); ++row) {
    for (Eigen::Index column = 0; column < mean_.cols(); ++column) {
      const Pixel* const first = pixels + row * factor_ * width_ + column * factor_;
      int sum = 0;
      for (int y = 0; y < factor_; ++y) {
        for (int x = 0; x < factor_; ++x) sum += first[y * width_ + x];
      }
      mean_(row, column) = static_cast<float>(sum) * share;
    }
  }
}

// A blade touches the border and carries no noise; dark bone carries none either where it is saturated, but
// lies inside.
void ViewReducer::find_blades(PixelGrid& open) {
  open.setOnes();
  measure_spread();
  const Eigen::Index last_row = open.rows() - 1;
  const Eigen::Index last_column = open.cols() - 1;
  for (Eigen::Index column = 0; column <= last_column; ++column) {
    shut_from(0, column, open);
    shut_from(last_row, column, open);
  }
  for (Eigen::Index row = 0; row <= last_row; ++row) {
    shut_from(row, 0, open);
    shut_from(row, last_column, open);
  }
  if (queue_.empty()) return;
  for (std::size_t next = 0; next < queue_.size(); ++next) {
    const Eigen::Index row = queue_[next] / open.cols();
    const Eigen::Index column = queue_[next] % open.cols();
    if (row > 0) shut_from(row - 1, column, open);
    if (row < last_row) shut_from(row + 1, column, open);
    if (column > 0) shut_from(row, column - 1, open);
    if (column < last_column) shut_from(row, column + 1, open);
  }
  for (const std::int32_t place : queue_) {
    const Eigen::Index row = place / open.cols();
    const Eigen::Index column = place % open.cols();
    const Eigen::Index top = std::max<Eigen::Index>(row - kBladeMargin, 0);
    const Eigen::Index left = std::max<Eigen::Index>(column - kBladeMargin, 0);
    open.block(top, left, std::min(row + kBladeMargin, last_row) - top + 1,
               std::min(column + kBladeMargin, last_column) - left + 1) = 0;
  }
  queue_.clear();
}

/// Greatest minus least of 3 x 3 reduced pixels; at the border as beside it.
void ViewReducer::measure_spread() {
  const Eigen::Index h = mean_.rows() - 2;
  const Eigen::Index w = mean_.cols() - 2;
  auto greatest = smooth_.block(1, 1, h, w);
  auto least = large_.block(1, 1, h, w);
  greatest = least = mean_.block(0, 0, h, w);
  for (Eigen::Index y = 0; y < 3; ++y) {
    for (Eigen::Index x = 0; x < 3; ++x) {
      greatest = greatest.max(mean_.block(y, x, h, w));
      least = least.min(mean_.block(y, x, h, w));
    }
  }
  spread_.block(1, 1, h, w) = greatest - least;
  spread_.col(0) = spread_.col(1);
  spread_.col(w + 1) = spread_.col(w);
  spread_.row(0) = spread_.row(1);
  spread_.row(h + 1) = spread_.row(h);
  some_spreads_.clear();
  for (std::size_t i = 0; i < static_cast<std::size_t>(spread_.size()); i += kSpreadStride) {
    some_spreads_.push_back(spread_.data()[i]);
  }
  const auto high = some_spreads_.begin() + static_cast<std::ptrdiff_t>(some_spreads_.size() * 9 / 10);
  std::nth_element(some_spreads_.begin(), high, some_spreads_.end());
  flat_spread_ = std::max(kMinFlatSpread, kFlatShare * *high);
}

/// Shuts a flat pixel.
void ViewReducer::shut_from(Eigen::Index row, Eigen::Index column, PixelGrid& open) {
  if (spread_(row, column) <= flat_spread_ && open(row, column) > 0) {
    open(row, column) = 0;
    queue_.push_back(static_cast<std::int32_t>(row * open.cols() + column));
  }
}

// Normalised convolution: what is shut weighs nothing, G * (open f) / G * open.
void ViewReducer::high_pass(ViewPicture& picture) {
  const PixelGrid& open = picture.open;
  if ((open != last_open_).any()) {
    last_open_ = open;
    weights_large_ = open;
    large_blur_.apply(weights_large_);
    weights_spread_ = open;
    spread_blur_.apply(weights_spread_);
  }
  large_ = mean_ * open;
  // 3 x 3 taps; the border keeps its own value.
  smooth_ = large_;
  weights_small_ = open;
  const Eigen::Index h = mean_.rows() - 2;
  const Eigen::Index w = mean_.cols() - 2;
  const auto taps = [h, w](const PixelGrid& from, PixelGrid& to) {
    constexpr float kMiddle = 1 - 2 * kSmall;
    to.block(1, 1, h, w).setZero();
    for (Eigen::Index y = 0; y < 3; ++y) {
      for (Eigen::Index x = 0; x < 3; ++x) {
        const float weight = (y == 1 ? kMiddle : kSmall) * (x == 1 ? kMiddle : kSmall);
        to.block(1, 1, h, w) += weight * from.block(y, x, h, w);
      }
    }
  };
  taps(large_, smooth_);
  taps(open, weights_small_);
  normalise(smooth_, weights_small_);
  large_blur_.apply(large_);
  normalise(large_, weights_large_);
  picture.texture = (smooth_ - large_) * open;
  // Over the local standard deviation, so that gain and window do not matter.
  large_ = picture.texture.square();
  spread_blur_.apply(large_);
  normalise(large_, weights_spread_);
  picture.texture =
      (picture.texture / (large_.sqrt() + kSpreadFloor)).max(-kMaxTexture).min(kMaxTexture) * open;
}

void ViewReducer::normalise(PixelGrid& values, const PixelGrid& weights) const {
  values = (weights > kMinWeight).select(values / weights.max(kMinWeight), 0.0F);
}

}  // namespace tubed
