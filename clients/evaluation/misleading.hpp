// Confidently wrong: shapes that are farther off than they say they can be. Monitors of the integrity of
// satellite navigation call that misleading information.
#pragma once

#include <cstddef>
#include <map>
#include <optional>

#include "clients/evaluation/estimates_csv.hpp"
#include "clients/evaluation/shape_error.hpp"

namespace tubed {

/// From when on the error of a point counts: beyond both.
struct MisleadingLimits {
  double distance_mm = 3;
  double sigmas = 3;
};

/// The judged points of one instant.
struct MisleadingPoints {
  std::size_t judged = 0;
  std::size_t misleading = 0;
  double max_mm = 0;  ///< greatest error of a misleading one; 0: there is none
  [[nodiscard]] bool any() const { return misleading > 0; }
};

/// Counts the points that are off by more than both limits. With e = estimated minus true point, u = e / |e|
/// and Sigma the published covariance of the estimated point, it is off by |e| and by |e| / sqrt(u' Sigma u)
/// sigmas: sigma is that along the error (as a confidence interval of this direction has it; it is never
/// smaller than the Mahalanobis distance's, sqrt(e' inv(Sigma) e) >= |e| / sqrt(u' Sigma u)).
///
/// Pairs (estimated, true), match kNearest: each true point with the point of the estimate's polyline that is
/// closest to it, and each estimated point with the closest of the true polyline, so that a tip too long and
/// a tip too short both count, and sliding along the catheter elsewhere does not. Match kArcLength: each true
/// point with the estimated one of the same s. Judged are the points (true ones, estimated ones) from the tip
/// to s_max_mm, with kInView those that `view` projects into its image; partners may lie beyond either.
/// Between estimated points Sigma is interpolated.
///
/// Nothing where the covariances are not known, a curve has fewer than two points, or none is judged.
std::optional<MisleadingPoints> misleading_points(const EstimatedShape& shape, const SampledCentreline& truth,
                                                  const Camera& view, const ShapeErrorSettings& settings,
                                                  const MisleadingLimits& limits = {});

/// Instants of one validity, or of several.
struct MisleadingCount {
  std::size_t instants = 0;    ///< for which misleading_points() has an answer
  std::size_t misleading = 0;  ///< with a misleading point
};

/// Of all validities together.
MisleadingCount total_of(const std::map<Validity, MisleadingCount>& counts);

}  // namespace tubed
