// Where along its own line a tube ends in the image.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// Found end: a place on the path, in samples from its first.
struct TubeEnd {
  double place = 0;     ///< mean of the posterior
  double variance = 0;  ///< of it
};

/// `path_px`: points about 1 px apart, from where no tube should be any more, over the expected end, to where
/// the tube surely is (at most kMaxEndSamples). `ridge_height`: vesselness of the tube as its neighbourhood
/// shows it (LineSearch::Outcome). Compares, for every place the tube may end at, ridge on the one side and
/// none on the other; pixels next to each other see the same noise and count accordingly. Nothing when no
/// place is clearly better than the path's own ends: something ridge-like goes on beyond the tip, or nothing
/// is seen before it; or part of the path has not been measured. Never allocates.
std::optional<TubeEnd> find_tube_end(const ImageMeasurement& image, std::span<const Eigen::Vector2d> path_px,
                                     float ridge_height);

constexpr int kMaxEndSamples = 64;

}  // namespace tubed
