// M = {M_f, M_b} of the paper: how the tube and what surrounds it look, as histograms over
// y = {grey value, vesselness}.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// A pixel of an image and where it lies: Phi of Sec. 2.2.2, positive inside the tube's projection.
struct PixelDistance {
  std::size_t index = 0;  ///< in the row by row buffers of ImageMeasurement
  float signed_distance_px = 0;
};

/// P_f = P(y | M_f) and P_b = P(y | M_b) of Eq. (16) for one camera. A value of the thread that uses it;
/// never allocates. It learns from pixels that learn() is told to be tube or background; the caller is
/// responsible for that choice.
class AppearanceModel {
 public:
  static constexpr int kGreyBins = 32;
  static constexpr int kVesselnessBins = 16;

  /// Pixels nearer to the contour than this on the outside are neither: the detector's point spread mixes
  /// them.
  static constexpr float kMargin_px = 3.0F;

  /// Takes the grey range of these pixels, and counts them: inside (Phi > 0) is tube, beyond the margin
  /// background. `share` 1 replaces what was known, smaller ones blend: old (1 - share) + new share, with the
  /// range as it was. False, and nothing is changed, when tube or background have fewer than 30 pixels.
  bool learn(const ImageMeasurement& image, std::span<const PixelDistance> pixels, double share);

  /// Probabilities of a pixel's bin; positive everywhere. Both 1 when nothing was learned.
  [[nodiscard]] float foreground(float grey, float vesselness) const;
  [[nodiscard]] float background(float grey, float vesselness) const;

  /// log(P_f / P_b); 0 when nothing was learned.
  [[nodiscard]] float log_odds(float grey, float vesselness) const {
    return learned_ ? log_odds_[bin_of(grey, vesselness)] : 0.0F;
  }

  [[nodiscard]] bool learned() const { return learned_; }
  void forget() { learned_ = false; }

 private:
  using Histogram = std::array<float, static_cast<std::size_t>(kGreyBins) * kVesselnessBins>;

  [[nodiscard]] std::size_t bin_of(float grey, float vesselness) const;
  void take_range(const ImageMeasurement& image, std::span<const PixelDistance> pixels);

  bool learned_ = false;
  float darkest_ = 0;
  float bins_per_grey_ = 1;
  Histogram foreground_{};
  Histogram background_{};
  Histogram log_odds_{};
};

}  // namespace tubed
