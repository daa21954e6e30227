// How coils go wrong, as the estimator takes it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "idl/estimate.hpp"

namespace tubed {

/// Each coil goes wrong on its own, and is right again after a while. A wrong one says nothing of the tube.
struct CoilFaultModel {
  double probability = 0.001;  ///< that a right coil has gone wrong, at each measurement
  double lasting_s = 0.5;      ///< mean time that it stays wrong
  double distance_mm = 30;     ///< standard deviation of its additional error, an axis
};

/// Probability of each coil to be right.
using CoilBeliefs = std::array<double, kMaxCoils>;

/// Nothing is certain: a logarithm must stay finite.
inline double bounded_belief(double belief) { return std::clamp(belief, 1e-6, 1 - 1e-6); }

/// What is believed of coils that have said nothing yet.
inline CoilBeliefs beliefs_at_first(const CoilFaultModel& model) {
  CoilBeliefs beliefs;
  beliefs.fill(bounded_belief(1 - model.probability));
  return beliefs;
}

/// What is still believed of a coil before its next measurement, `dt_s` after the last.
inline double aged_belief(const CoilFaultModel& model, double belief, double dt_s) {
  const double gets_right = -std::expm1(-std::max(dt_s, 0.0) / model.lasting_s);
  return bounded_belief(belief * (1 - model.probability) + (1 - belief) * gets_right);
}

/// chi^2 of a single measurement that has to be saved before a coil is the likelier left out of it, where it
/// was believed so much before and errs by `sigma_mm` on an axis when it is right. Of its position; a wrong
/// coil's direction is not modelled.
inline double gain_to_leave_out(const CoilFaultModel& model, double belief, double sigma_mm) {
  const double right = bounded_belief(belief);
  const double ratio = model.distance_mm / sigma_mm;
  // Twice the logarithm of the odds, and of the ratio of the two densities' heights.
  return 2 * std::log(right / (1 - right)) + 3 * std::log1p(ratio * ratio);
}

}  // namespace tubed
