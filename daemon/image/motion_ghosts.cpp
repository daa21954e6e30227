#include "daemon/image/motion_ghosts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tubed {

namespace {

constexpr std::size_t kSmooth_px = 2;     // to either side: noise counts less
constexpr int kAround_px = 8;             // to either side: more than the tube's width
constexpr float kMoved = 7;               // standard deviations of noise
constexpr float kHalfUndone = 8;          // the same, of what is undone once they are found
constexpr double kGhost = 0.5;            // of what undoing adds to a change, beyond all that is around
constexpr int kMinMoved = 8;              // pixels on each side, for an image to say something
constexpr int kMinImages = 8;             // that have said something
constexpr double kNewest = 0.1;           // what the newest image counts
constexpr double kGhostsAreThere = 0.25;  // share on both sides
constexpr double kGhostsAreGone = 0.15;
constexpr float kMedian = 0.6745F;  // of |x|, x ~ N(0, 1)
constexpr float kMinNoise = 0.15F;  // grey steps

float middle_of(std::span<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

float mean_around(std::span<const float> row, std::size_t x) {
  const std::size_t first = std::max(x, kSmooth_px) - kSmooth_px;
  const std::size_t last = std::min(row.size(), x + kSmooth_px + 1);
  float sum = 0;
  for (std::size_t k = first; k < last; ++k) sum += row[k];
  return sum / static_cast<float>(last - first);
}

/// Means of five neighbours, of fewer at the ends. Preconditions: as many in both, other memory.
void smooth(std::span<const float> row, std::span<float> to) {
  const std::size_t count = row.size();
  for (std::size_t x = 0; x < std::min(kSmooth_px, count); ++x) to[x] = mean_around(row, x);
  for (std::size_t x = kSmooth_px; x + kSmooth_px < count; ++x) {
    to[x] = 0.2F * (row[x - 2] + row[x - 1] + row[x] + row[x + 1] + row[x + 2]);
  }
  for (std::size_t x = std::max(count, 2 * kSmooth_px) - kSmooth_px; x < count; ++x)
    to[x] = mean_around(row, x);
}

}  // namespace

MotionGhosts::MotionGhosts(int width, int height, int stride)
    : width_(width), height_(height), stride_(stride) {
  const std::size_t rows = height > 0 ? static_cast<std::size_t>((height - 1) / stride + 1) : 0;
  row_.resize(static_cast<std::size_t>(width));
  before_.resize(rows * row_.size());
  noise_.resize(rows * (row_.size() / kBlock_px));
  scratch_.resize(kBlock_px);
}

void MotionGhosts::look_at(std::span<const float> grey, bool follows, double share, double step) {
  if (share <= 0) {
    has_before_ = false;
    are_there_ = false;
    informative_ = 0;
    return;
  }
  min_noise_ = kMinNoise * static_cast<float>(step);
  brighter_.moved = brighter_.ghosts = darker_.moved = darker_.ghosts = 0;
  const auto columns = static_cast<std::size_t>(width_);
  const bool compares = has_before_ && follows;
  std::size_t row = 0;
  for (int y = 0; y < height_; y += stride_, ++row) {
    smooth(grey.subspan(static_cast<std::size_t>(y) * columns, columns), row_);
    const auto before = std::span(before_).subspan(row * columns, columns);
    if (compares) look_at_row(before, row * (columns / kBlock_px), share);
    std::ranges::copy(row_, before.begin());
  }
  if (compares) judge();
  has_before_ = true;
}

// Noise is not the same in dark and in bright places.
void MotionGhosts::look_at_row(std::span<const float> before, std::size_t first_block, double share) {
  for (int block = 0; block < width_ / kBlock_px; ++block) {
    const int first = block * kBlock_px;
    for (int i = 0; i < kBlock_px; ++i) {
      const auto x = static_cast<std::size_t>(first + i);
      scratch_[static_cast<std::size_t>(i)] = std::abs(row_[x] - before[x]);
    }
    const float found = middle_of(scratch_) / kMedian;
    float& noise = noise_[first_block + static_cast<std::size_t>(block)];
    noise = noise > 0 ? noise + static_cast<float>(kNewest) * (found - noise) : found;
    const float limit = kMoved * std::max(noise, min_noise_);
    for (int x = first; x < first + kBlock_px; ++x) {
      const float change = row_[static_cast<std::size_t>(x)] - before[static_cast<std::size_t>(x)];
      if (std::abs(change) > limit) look_at_pixel(x, change, share);
    }
  }
}

// Undone it would be `share` / (1 - `share`) changes further.
void MotionGhosts::look_at_pixel(int x, float change, double share) {
  const auto first = row_.begin() + std::max(0, x - kAround_px);
  const auto last = row_.begin() + std::min(width_, x + kAround_px + 1);
  const float here = row_[static_cast<std::size_t>(x)];
  const float room =
      change > 0 ? *std::max_element(first, last) - here : here - *std::min_element(first, last);
  Side& side = change > 0 ? brighter_ : darker_;
  ++side.moved;
  side.ghosts += room < (1 - kGhost) * share / (1 - share) * std::abs(change) ? 1 : 0;
}

void MotionGhosts::weigh(int y, std::span<const float> change, std::span<float> weights) const {
  smooth(change, weights);
  const int blocks = width_ / kBlock_px;
  const float* const noise = &noise_[static_cast<std::size_t>(y / stride_ * blocks)];
  for (int block = 0; block < blocks; ++block) {
    const int first = block * kBlock_px;
    const int last = block + 1 < blocks ? first + kBlock_px : width_;
    const float limit = kHalfUndone * std::max(noise[block], min_noise_);
    for (float& weight :
         weights.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(last - first))) {
      const float square = weight * weight / (limit * limit);
      weight = 1 / (1 + square * square);
    }
  }
}

void MotionGhosts::judge() {
  if (std::min(brighter_.moved, darker_.moved) < kMinMoved) return;
  ++informative_;
  const double newest = std::max(kNewest, 1.0 / informative_);
  for (Side* side : {&brighter_, &darker_}) {
    side->share += newest * (static_cast<double>(side->ghosts) / side->moved - side->share);
  }
  const double lesser = std::min(brighter_.share, darker_.share);
  are_there_ = informative_ >= kMinImages && lesser > (are_there_ ? kGhostsAreGone : kGhostsAreThere);
}

}  // namespace tubed
