// The paper's noise of EM sensors: constant amplitude, random direction, drawn anew for each sample.
#pragma once

#include <Eigen/Core>

#include "drivers/laboratory/random/counter_random.hpp"

namespace tubed {

/// Eq. (19): p moved by exactly `lambda_mm` in the direction of a point drawn uniformly from the cube [-1,
/// 1]^3.
Eigen::Vector3d noisy_position(const Eigen::Vector3d& p_mm, double lambda_mm, CounterRandom& random);

/// Eq. (20): t turned by `psi_rad` about a random axis a = (cos theta sin phi, sin theta sin phi, cos phi)
/// with theta = acos(2 r4 - 1), phi = 2 pi r5, as printed: the axis is not uniform on the sphere, and t
/// itself moves by at most psi, less the nearer it is to the axis.
Eigen::Vector3d noisy_tangent(const Eigen::Vector3d& tangent, double psi_rad, CounterRandom& random);

}  // namespace tubed
