// Where along its own line a tube ends in the image.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// Found end: a place on the path, in samples from its first.
struct TubeEnd {
  double place = 0;     ///< mean of the posterior
  double variance = 0;  ///< of it
};

constexpr int kMaxEndSamples = 64;

/// The path that is asked where on it a tube ends: points about 1 px apart, from where no tube should be any
/// more, over the expected end, to where the tube surely is.
class EndPath {
 public:
  /// `found_px`: where the tube was found, tip first, at least four, `spacing_mm` apart along it. The path
  /// goes on straight for `outside_px` beyond the tip and ends at the last of them at most. Nothing where the
  /// tip points at the source of the rays: less than 0.2 px a mm.
  static std::optional<EndPath> over(std::span<const Eigen::Vector2d> found_px, double spacing_mm,
                                     int outside_px);

  [[nodiscard]] std::span<const Eigen::Vector2d> points_px() const { return {points_px_.data(), count_}; }
  /// Between its points; `place` in samples from the first.
  [[nodiscard]] Eigen::Vector2d at(double place) const;
  /// Unit, the direction in which the tube points at its tip.
  [[nodiscard]] const Eigen::Vector2d& outward() const { return outward_; }

 private:
  std::array<Eigen::Vector2d, kMaxEndSamples> points_px_;
  std::size_t count_ = 0;
  Eigen::Vector2d outward_ = Eigen::Vector2d::UnitX();
};

/// `path_px`: an EndPath's, at most kMaxEndSamples. `ridge_height`: vesselness of the tube as its
/// neighbourhood shows it (LineSearch::Outcome). Compares, for every place the tube may end at, ridge on the
/// one side and none on the other; pixels next to each other see the same noise and count accordingly.
/// Nothing when no place is clearly better than the path's own ends: something ridge-like goes on beyond the
/// tip, or nothing is seen before it; or part of the path has not been measured. A ridge filter answers
/// beyond a tube's end as well, the further the darker it is: see sharpened(). Never allocates.
std::optional<TubeEnd> find_tube_end(const ImageMeasurement& image, std::span<const Eigen::Vector2d> path_px,
                                     float ridge_height);

/// That end by the greys instead of the ridge filter: how much darker (brighter, as the image's polarity is)
/// the tube is over its width than beside it, along the path, is a step that a radiograph has blurred; its
/// place, and the levels on both sides, are fitted in least squares within a few pixels of `end`. Nothing
/// where no step stands out of the noise there. `half_width_px`: of the tube's projection. Never allocates.
std::optional<TubeEnd> sharpened(const TubeEnd& end, const ImageMeasurement& image,
                                 std::span<const Eigen::Vector2d> path_px, double half_width_px);

}  // namespace tubed
