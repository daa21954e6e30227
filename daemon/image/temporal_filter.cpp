#include "daemon/image/temporal_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tubed {

namespace {

constexpr int kSamples = 16384;         // about so many pixels of an image are looked at
constexpr int kApart_px = 2;            // of the second difference: noise of neighbours is alike
constexpr double kRounding = 1 / 12.0;  // variance of a rounding error, steps^2
constexpr double kCurvedVariance = 6;   // of x - 2 y + z
constexpr double kMinNoise = 1;         // variance of D, steps^2: where there is less nothing is said
constexpr std::size_t kMinBlocks = 16;
constexpr double kMaxSpread = 0.06;      // of correlations of single images about their mean
constexpr double kContradiction = 0.03;  // of correlations of eight images
constexpr double kMinShare = 0.15;       // less is not worth mending,
constexpr double kMaxShare = 0.9;        // more would be noise alone
constexpr double kMaxBefore = 0.95;      // of both together
constexpr double kErrorOfSecond = 0.1;   // where there is none
constexpr double kRhythm = 0.3;          // share of an interval that stamps may be off by
constexpr int kMaxMissing = 3;
constexpr float kMaxWords = 16;
constexpr float kMaxWord = 65535;

float middle_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool are_alike_s(double interval_s, double other_s) {
  return std::abs(interval_s - other_s) < kRhythm * other_s;
}

bool are_alike(const DifferenceCorrelations& a, const DifferenceCorrelations& b) {
  return std::abs(a.by_one - b.by_one) < kMaxSpread && std::abs(a.by_two - b.by_two) < kMaxSpread &&
         std::abs(a.by_three - b.by_three) < kMaxSpread;
}

std::uint16_t in_words(float grey, float words) {
  return static_cast<std::uint16_t>(std::min(words * grey + 0.5F, kMaxWord));
}

}  // namespace

// w and l are the roots of x^2 - phi_1 x - phi_2. Where both are small errors leave none: r_1 alone says w.
std::optional<TemporalFilter> filter_of(const DifferenceCorrelations& r) {
  const double phi_1 = (1 + 2 * r.by_one + r.by_two) / (1 + r.by_one);
  const double phi_2 = r.by_two - phi_1 * r.by_one;
  const double discriminant = phi_1 * phi_1 + 4 * phi_2;
  const double root = std::sqrt(std::max(discriminant, 0.0));
  const TemporalFilter found = discriminant > 0 ? TemporalFilter{(phi_1 + root) / 2, (phi_1 - root) / 2}
                                                : TemporalFilter{1 + 2 * r.by_one, 0};
  const double of_two = r.by_two - found.phi_1() * r.by_one - found.phi_2();
  const double of_three = r.by_three - found.phi_1() * r.by_two - found.phi_2() * r.by_one;
  const bool is_one = found.share >= kMinShare && found.second >= -kErrorOfSecond &&
                      found.of_before() <= kMaxBefore && std::abs(of_two) <= kContradiction &&
                      std::abs(of_three) <= kContradiction;
  if (!is_one) {
    return std::nullopt;
  }
  return TemporalFilter{std::min(found.share, kMaxShare), found.second};
}

TemporalFilterFinder::TemporalFilterFinder(int width, int height)
    : width_(width),
      height_(height),
      stride_(std::max(1, width * height / kSamples)),
      blocks_(std::max(0, width - 2 * kApart_px) / kBlock_px),
      ghosts_(width, height, stride_) {
  const std::size_t rows = height_ > 0 ? static_cast<std::size_t>((height_ - 1) / stride_ + 1) : 0;
  const std::size_t blocks = rows * static_cast<std::size_t>(blocks_);
  curved_.resize(blocks * kBlock_px);
  for (std::size_t k = 0; k < kBefore; ++k) {
    changed_[k].resize(blocks * kBlock_px);
    by_[k].reserve(blocks);
  }
}

void TemporalFilterFinder::look_at(std::span<const float> grey, MonotonicTime exposure, double step) {
  keep_rhythm(exposure);
  correlate(grey, step);
  if (remembered_ == kBefore + 1) {
    read();
  }
  remembered_ = std::min(remembered_ + 1, kBefore + 1);
  ghosts_.look_at(grey, exposures_between_ == 1, filter_.of_before(), step);
}

// Differences over a pause, or where an image is missing, are others. A new rhythm is one that comes twice.
void TemporalFilterFinder::keep_rhythm(MonotonicTime exposure) {
  const bool is_first = to_ns(newest_) == 0;
  const double interval_s = is_first ? 0 : seconds_between(newest_, exposure);
  newest_ = exposure;
  exposures_between_ = 0;
  if (are_alike_s(interval_s, odd_s_)) {
    rhythm_s_ = interval_s;
  }
  if (are_alike_s(interval_s, rhythm_s_)) {
    exposures_between_ = 1;
    return;
  }
  remembered_ = 0;
  odd_s_ = interval_s;
  for (int missing = 2; missing <= kMaxMissing; ++missing) {
    if (std::abs(interval_s - missing * rhythm_s_) < kRhythm * rhythm_s_) exposures_between_ = missing;
  }
}

void TemporalFilterFinder::correlate(std::span<const float> grey, double step) {
  for (std::vector<float>& of_blocks : by_) of_blocks.clear();
  std::size_t block = 0;
  for (int y = 0; y < height_ && blocks_ > 0; y += stride_) {
    const float* const row = &grey[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
    for (int i = 0; i < blocks_; ++i) {
      correlate_block(row + kApart_px + i * kBlock_px, block++, step);
    }
  }
}

// Rounding errors are independent, too: each D has two, and shares one with the D before.
void TemporalFilterFinder::correlate_block(const float* grey, std::size_t block, double step) {
  const std::size_t first = block * kBlock_px;
  float* const curved = &curved_[first];
  float* const one = &changed_[0][first];
  float* const two = &changed_[1][first];
  float* const three = &changed_[2][first];
  std::array<float, kBefore + 1> squares{};
  std::array<float, kBefore> products{};
  for (int i = 0; i < kBlock_px; ++i) {
    const float now = grey[i - kApart_px] - 2 * grey[i] + grey[i + kApart_px];
    const float change = now - curved[i];
    squares[0] += change * change;
    squares[1] += one[i] * one[i];
    squares[2] += two[i] * two[i];
    squares[3] += three[i] * three[i];
    products[0] += change * one[i];
    products[1] += change * two[i];
    products[2] += change * three[i];
    curved[i] = now;
    three[i] = two[i];
    two[i] = one[i];
    one[i] = change;
  }
  const auto rounding = static_cast<float>(kBlock_px * kCurvedVariance * kRounding * step * step);
  const auto least = static_cast<float>(kBlock_px * kMinNoise * step * step);
  for (float& square : squares) {
    square -= 2 * rounding;
    if (square < least) return;
  }
  products[0] += rounding;
  for (std::size_t k = 0; k < kBefore; ++k) {
    by_[k].push_back(products[k] / std::sqrt(squares[0] * squares[k + 1]));
  }
}

// What moves is in few of the blocks.
void TemporalFilterFinder::read() {
  if (by_[0].size() < kMinBlocks) {
    return;
  }
  readings_[next_] = {middle_of(by_[0]), middle_of(by_[1]), middle_of(by_[2])};
  next_ = (next_ + 1) % kWitnesses;
  ++read_;
  DifferenceCorrelations mean;
  for (const DifferenceCorrelations& of_image : readings_) {
    mean.by_one += of_image.by_one / kWitnesses;
    mean.by_two += of_image.by_two / kWitnesses;
    mean.by_three += of_image.by_three / kWitnesses;
  }
  if (read_ >= kWitnesses && agreeing_with(mean) == kWitnesses) {
    filter_ = filter_of(mean).value_or(TemporalFilter{});
    agreed_ = mean;
  } else if (2 * agreeing_with(agreed_) < kWitnesses) {
    filter_ = {};
  }
}

std::size_t TemporalFilterFinder::agreeing_with(const DifferenceCorrelations& asked) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      readings_, [&](const DifferenceCorrelations& of_image) { return are_alike(of_image, asked); }));
}

TemporalFilterInverse::TemporalFilterInverse(int width, int height)
    : before_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      two_before_(before_.size()),
      seen_(static_cast<std::size_t>(width)),
      change_(seen_.size()),
      weights_(seen_.size()) {}

void TemporalFilterInverse::keep(std::span<const float> grey) {
  std::swap(before_, two_before_);
  std::ranges::transform(grey, before_.begin(), [this](float value) { return in_words(value, words_); });
  kept_ = 1;
}

void TemporalFilterInverse::undo_row(const Inverse& inverse, std::size_t first,
                                     std::span<const float> shown) {
  for (std::size_t x = 0; x < shown.size(); ++x) {
    seen_[x] = inverse.scale * shown[x] - inverse.of_before * static_cast<float>(before_[first + x]) -
               inverse.of_two_before * static_cast<float>(two_before_[first + x]);
  }
}

void TemporalFilterInverse::hold_what_moved(const MotionGhosts& ghosts, int y, std::size_t first,
                                            std::span<const float> shown) {
  for (std::size_t x = 0; x < shown.size(); ++x) {
    change_[x] = shown[x] - static_cast<float>(before_[first + x]) / words_;
  }
  ghosts.weigh(y, change_, weights_);
  for (std::size_t x = 0; x < shown.size(); ++x) {
    seen_[x] = shown[x] + weights_[x] * (seen_[x] - shown[x]);
  }
}

void TemporalFilterInverse::undo(const TemporalFilter& filter, const MotionGhosts& ghosts,
                                 int exposures_between, float white, ImageMeasurement& image) {
  const float words = std::clamp(std::floor(kMaxWord / white), 1.0F, kMaxWords);
  if (kept_ == 0 || exposures_between == 0 || words != words_) {
    words_ = words;
    keep(image.grey);
    return;
  }
  const bool has_both = kept_ == 2 && exposures_between == 1;
  const double phi_1 = has_both ? filter.phi_1() : std::pow(filter.share, exposures_between);
  const double phi_2 = has_both ? filter.phi_2() : 0;
  const auto scale = static_cast<float>(1 / (1 - phi_1 - phi_2));
  const Inverse inverse{scale, static_cast<float>(phi_1) * scale / words_,
                        static_cast<float>(phi_2) * scale / words_};
  float least = white;
  float greatest = 0;
  const std::size_t columns = seen_.size();
  for (int y = 0; y < image.height; ++y) {
    const std::size_t first = static_cast<std::size_t>(y) * columns;
    const auto row = std::span(image.grey).subspan(first, columns);
    undo_row(inverse, first, row);
    if (ghosts.are_there()) hold_what_moved(ghosts, y, first, row);
    for (std::size_t x = 0; x < columns; ++x) {
      two_before_[first + x] = in_words(row[x], words_);
      row[x] = std::clamp(seen_[x], 0.0F, white);
      least = std::min(least, row[x]);
      greatest = std::max(greatest, row[x]);
    }
  }
  std::swap(before_, two_before_);
  kept_ = exposures_between == 1 ? 2 : 1;
  image.darkest = least;
  image.brightest = greatest;
}

}  // namespace tubed
