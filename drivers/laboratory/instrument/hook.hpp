// A tip that its maker has bent: a circle in one plane of the catheter.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace tubed {

/// The last `length_mm` of a catheter are a circle while nothing bends them.
struct Hook {
  double radius_mm = 0;  ///< of the circle; 0: the tip is straight
  double length_mm = 0;  ///< along the catheter, from the tip
  double roll_rad = 0;   ///< of the circle's plane against the one in which commands bend the tip

  [[nodiscard]] bool is_there() const { return radius_mm > 0; }
  /// By which the catheter turns over the `spacing_mm` around arc length `s_mm` from the tip.
  [[nodiscard]] double turn_rad(double s_mm, double spacing_mm) const {
    const double in_hook_mm = std::clamp(length_mm - (s_mm - spacing_mm / 2), 0.0, spacing_mm);
    return is_there() ? in_hook_mm / radius_mm : 0.0;
  }
};

/// The chain of a catheter's nodes (3 x n, mm, world, tip first, `spacing_mm` as in CatheterShape) with the
/// hook added to what the chain does already: each edge of the hook is turned as the chain turns it and by
/// the hook's circle besides, in the frame that is carried along the chain. So the hook is as stiff as steel:
/// a wall bends what is beneath it and not the circle itself. `toward`: 3 x (n - 1), the unit vector at each
/// edge, at right angles to it, toward which the circle turns. The part behind the hook stays where it is.
Eigen::Matrix3Xd with_hook(const Eigen::Matrix3Xd& nodes_world_mm, double spacing_mm, const Hook& hook,
                           const Eigen::Matrix3Xd& toward);

}  // namespace tubed
