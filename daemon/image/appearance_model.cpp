#include "daemon/image/appearance_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tubed {

namespace {

constexpr int kMinPixels = 30;
// What no pixel showed so far may come all the same: this share of the mass is spread over all bins.
constexpr float kUnseen = 0.02F;
constexpr int kSmoothings = 2;  // of [1 2 1] / 4 along each axis: images of few grey levels leave combs

/// [1 2 1] / 4 over `count` elements `stride` apart; at the ends the mass stays inside.
void smooth_along(float* first, int count, std::ptrdiff_t stride) {
  float before = first[0];
  for (int i = 0; i < count; ++i) {
    float& here = first[i * stride];
    const float after = i + 1 < count ? first[(i + 1) * stride] : here;
    const float old = here;
    here = 0.25F * (before + 2 * old + after);
    before = old;
  }
}

template <typename Histogram>
void smooth(Histogram& histogram) {
  constexpr int kColumns = AppearanceModel::kVesselnessBins;
  constexpr int kRows = AppearanceModel::kGreyBins;
  for (int round = 0; round < kSmoothings; ++round) {
    for (int row = 0; row < kRows; ++row) smooth_along(histogram.data() + row * kColumns, kColumns, 1);
    for (int column = 0; column < kColumns; ++column)
      smooth_along(histogram.data() + column, kRows, kColumns);
  }
}

template <typename Histogram>
void to_probabilities(Histogram& counts) {
  smooth(counts);
  const float sum = std::accumulate(counts.begin(), counts.end(), 0.0F);
  const float each = kUnseen / static_cast<float>(counts.size());
  for (float& value : counts) value = (1 - kUnseen) * value / sum + each;
}

template <typename Histogram>
void blend(const Histogram& fresh, float share, Histogram& known) {
  for (std::size_t i = 0; i < fresh.size(); ++i) known[i] += share * (fresh[i] - known[i]);
}

}  // namespace

std::size_t AppearanceModel::bin_of(float grey, float vesselness) const {
  // The square root gives the many small vesselnesses of the background bins of their own.
  const float column = std::sqrt(std::clamp(vesselness, 0.0F, 1.0F)) * kVesselnessBins;
  const float row = std::clamp((grey - darkest_) * bins_per_grey_, 0.0F, kGreyBins - 1.0F);
  return static_cast<std::size_t>(row) * kVesselnessBins +
         std::min<std::size_t>(static_cast<std::size_t>(column), kVesselnessBins - 1);
}

void AppearanceModel::take_range(const ImageMeasurement& image, std::span<const PixelDistance> pixels) {
  darkest_ = image.grey[pixels.front().index];
  float brightest = darkest_;
  for (const PixelDistance& pixel : pixels) {
    darkest_ = std::min(darkest_, image.grey[pixel.index]);
    brightest = std::max(brightest, image.grey[pixel.index]);
  }
  bins_per_grey_ = static_cast<float>(kGreyBins) / std::max(brightest - darkest_, 1e-6F);
}

bool AppearanceModel::learn(const ImageMeasurement& image, std::span<const PixelDistance> pixels,
                            double share) {
  const auto inside = std::count_if(pixels.begin(), pixels.end(),
                                    [](const PixelDistance& p) { return p.signed_distance_px > 0; });
  const auto outside = std::count_if(pixels.begin(), pixels.end(), [](const PixelDistance& p) {
    return p.signed_distance_px < -kMargin_px;
  });
  if (inside < kMinPixels || outside < kMinPixels) {
    return false;
  }
  const bool replaces = !learned_ || share >= 1;
  if (replaces) take_range(image, pixels);
  Histogram tube{};
  Histogram rest{};
  for (const PixelDistance& pixel : pixels) {
    const std::size_t bin = bin_of(image.grey[pixel.index], image.vesselness[pixel.index]);
    if (pixel.signed_distance_px > 0) {
      tube[bin] += 1;
    } else if (pixel.signed_distance_px < -kMargin_px) {
      rest[bin] += 1;
    }
  }
  to_probabilities(tube);
  to_probabilities(rest);
  blend(tube, replaces ? 1.0F : static_cast<float>(share), foreground_);
  blend(rest, replaces ? 1.0F : static_cast<float>(share), background_);
  for (std::size_t i = 0; i < log_odds_.size(); ++i) {
    log_odds_[i] = std::log(foreground_[i] / background_[i]);
  }
  learned_ = true;
  return true;
}

float AppearanceModel::foreground(float grey, float vesselness) const {
  return learned_ ? foreground_[bin_of(grey, vesselness)] : 1.0F;
}

float AppearanceModel::background(float grey, float vesselness) const {
  return learned_ ? background_[bin_of(grey, vesselness)] : 1.0F;
}

}  // namespace tubed
