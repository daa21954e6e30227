// The centreline of a catheter from its CT: the truth of an experiment that has no other.
#pragma once

#include <Eigen/Core>

#include "bench/accuracy/ct_scan.hpp"
#include "clients/evaluation/shape_error.hpp"

namespace tubed {

/// How finely the centreline is found.
struct SegmentationSettings {
  double layer_mm = 2;         ///< of the catheter, whose voxels give a first point
  double slab_mm = 1;          ///< half the thickness of the slab across, whose voxels centre that point
  double across_mm = 2.2;      ///< half its width
  int rounds = 3;              ///< of centring
  double knot_spacing_mm = 8;  ///< of the smoothing spline
};

/// 1. Threshold: half way from background (median of the voxels) to shaft (their 99.8th percentile).
/// 2. The largest set of voxels above it that touch one another by face, edge or corner.
/// 3. Ordered moments: geodesic distance through that set from the end that is nearer to `near_tip_mm` (which
/// a
///    person has pointed at); of each layer of it, the mean of the voxels' places, weighted with what they
///    exceed the threshold by.
/// 4. Centring: the same mean over the slab across the curve at each point, which moves across only.
/// 5. The tip: where the value along the last tangent falls below the threshold.
/// 6. A cubic B-spline of least squares over arc length through all of these.
/// Returns points every millimetre of arc length from the tip. Throws std::runtime_error when no voxel stands
/// out, or when they are too few for a curve.
SampledCentreline segment_catheter(const CtScan& scan, const Eigen::Vector3d& near_tip_mm,
                                   const SegmentationSettings& settings = {});

}  // namespace tubed
