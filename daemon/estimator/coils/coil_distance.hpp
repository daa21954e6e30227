// How far coils are off a shape, what stays of their errors left out of account.
#pragma once

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// From the shape C (3 x at least the spline's coefficients, mm, world) to where the coil says it is.
inline Eigen::Vector3d off_coil_mm(const CoilObservation& coil, const UniformCubicBSpline& spline,
                                   const Eigen::Matrix3Xd& C) {
  const CubicBasis basis = spline.basis(coil.s_mm);
  return coil.p_world_mm - combine(C, basis.first, basis.value);
}

/// chi^2 of that over the used coils, 3 degrees of freedom each; sigma of one coil, an axis.
inline double distance_from_coils(const CoilObservations& coils, const UniformCubicBSpline& spline,
                                  const Eigen::Matrix3Xd& C, double sigma_mm) {
  double sum_mm2 = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used()) {
      sum_mm2 += off_coil_mm(coil, spline, C).squaredNorm();
    }
  }
  return sum_mm2 / (sigma_mm * sigma_mm);
}

}  // namespace tubed
