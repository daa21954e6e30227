// A coil at rest: where it was, how it shook, whether it moved.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "clients/calibration/coil_recording.hpp"

namespace tubed {

/// Means over a time in which a coil was still.
struct CoilRest {
  int measurements = 0;
  Eigen::Vector3d p_em_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d tangent_em = Eigen::Vector3d::UnitZ();  ///< unit, as measured
  Eigen::Vector3d noise_mm = Eigen::Vector3d::Zero();  ///< white, an axis, from one measurement to the next
  double moved_mm = 0;                                 ///< furthest that two means of half a second lie apart
  double moved_limit_mm = 1;                           ///< what noise makes of that, and a drift nobody minds
};

/// Nothing for a coil with fewer than `min_measurements`.
std::optional<CoilRest> rest_of(const std::vector<SequenceMeasurement>& measurements,
                                const CoilPlacement& coil, int min_measurements);

}  // namespace tubed
