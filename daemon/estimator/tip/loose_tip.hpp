// A tip that no coil holds: how it is followed through images, and how much it may bend.
#pragma once

#include <Eigen/Core>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/tip/rest_hook.hpp"

namespace tubed {

/// How much of the tube, mm from the tip, lies before whatever says to which side it turns: before the first
/// coil that takes part where that is far from the tip, or in a hook with no coil in it. 0: the tip is held.
/// `hook` nullptr: a straight tip.
double loose_tip_mm(const CoilObservations& coils, const RestHook* hook);

/// From the first coil outward, a piece of it at a time: calls `follow(from_mm)` with the arc length (mm from
/// the tip) at which what is looked for begins, until it says that there is nothing to look at. `loose_mm`:
/// arc length of the first coil that takes part.
template <typename Follow>
void trace_loose_tip(double loose_mm, const Follow& follow) {
  constexpr double kPiece_mm = 8;
  for (double from_mm = loose_mm - kPiece_mm; from_mm > 0 && follow(from_mm); from_mm -= kPiece_mm) {
  }
}

/// What was followed may bend more than tubes mostly do: a shape of the settings' stiffness would cut its
/// bends short, and put what is left of its length into depth. Sets TubeMap::set_bending()'s factors over the
/// first `loose_mm` of `length_mm`; never allocates.
void soften_loose_tip(double loose_mm, double length_mm, Eigen::VectorXd& bending);

}  // namespace tubed
