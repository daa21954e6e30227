// A tip that its maker has bent: arcs in one plane of the catheter.
#pragma once

#include <Eigen/Core>

#include "drivers/interface/rest_curve.hpp"

namespace tubed {

/// What the end of a catheter is like while nothing bends it, and how it is rolled.
struct Hook {
  RestCurve curve;      ///< a circle's arc, or several; none: the tip is straight
  double roll_rad = 0;  ///< of its plane against the one in which commands bend the tip

  [[nodiscard]] bool is_there() const { return length_mm() > 0; }
  [[nodiscard]] double length_mm() const { return curve.length_mm(); }
  /// By which the catheter turns over the `spacing_mm` around arc length `s_mm` from the tip.
  [[nodiscard]] double turn_rad(double s_mm, double spacing_mm) const {
    return curve.turn_rad(s_mm - spacing_mm / 2, s_mm + spacing_mm / 2);
  }
};

/// The chain of a catheter's nodes (3 x n, mm, world, tip first, `spacing_mm` as in CatheterShape) with the
/// hook added to what the chain does already: each edge of the hook is turned as the chain turns it and by
/// the hook's arcs besides, in the frame that is carried along the chain. So the hook is as stiff as steel:
/// a wall bends what is beneath it and not the arcs themselves. `toward`: 3 x (n - 1), the unit vector at
/// each edge, at right angles to it, toward which an arc with a positive radius turns. The part behind the
/// hook stays where it is.
Eigen::Matrix3Xd with_hook(const Eigen::Matrix3Xd& nodes_world_mm, double spacing_mm, const Hook& hook,
                           const Eigen::Matrix3Xd& toward);

}  // namespace tubed
