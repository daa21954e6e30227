// What a catheter's tip is like while nothing bends it: arcs and straight pieces in one plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tubed {

/// A piece of a rest curve.
struct RestArc {
  double length_mm = 0;  ///< along the middle of the catheter
  double radius_mm = 0;  ///< of its circle; 0: straight; negative: it turns to the other side
  friend bool operator==(const RestArc&, const RestArc&) = default;

  [[nodiscard]] double curvature_per_mm() const { return radius_mm == 0 ? 0 : 1 / radius_mm; }
};

/// Arcs from the tip on, each going on where the one before it ends, all in one plane. Behind the last one,
/// and without any, the catheter is straight. A hook is a single arc.
struct RestCurve {
  std::vector<RestArc> arcs;

  static RestCurve hook(double radius_mm, double length_mm) { return {{{length_mm, radius_mm}}}; }
  /// From length and radius of each arc, one after the other; an odd last number is left out.
  static RestCurve from_pairs(const std::vector<double>& numbers) {
    RestCurve curve;
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2)
      curve.arcs.push_back({numbers[i], numbers[i + 1]});
    return curve;
  }

  /// Where the catheter begins to be bent, mm from the tip; 0: it is straight.
  [[nodiscard]] double length_mm() const {
    double end_mm = 0;
    double bent_until_mm = 0;
    for (const RestArc& arc : arcs) {
      end_mm += arc.length_mm;
      if (arc.radius_mm != 0) bent_until_mm = end_mm;
    }
    return bent_until_mm;
  }

  /// By which it turns between two arc lengths, rad, signed as the radii are. The first arc goes on beyond
  /// the tip.
  [[nodiscard]] double turn_rad(double from_mm, double to_mm) const {
    double turn_rad = 0;
    double begin_mm = -std::numeric_limits<double>::infinity();
    double end_mm = 0;
    for (const RestArc& arc : arcs) {
      end_mm += arc.length_mm;
      const double shared_mm = std::min(end_mm, to_mm) - std::max(begin_mm, from_mm);
      turn_rad += std::max(shared_mm, 0.0) * arc.curvature_per_mm();
      begin_mm = end_mm;
    }
    return turn_rad;
  }

  /// Absolute turns of all arcs, rad.
  [[nodiscard]] double whole_turn_rad() const {
    double turn_rad = 0;
    for (const RestArc& arc : arcs) turn_rad += arc.length_mm * std::abs(arc.curvature_per_mm());
    return turn_rad;
  }

  friend bool operator==(const RestCurve&, const RestCurve&) = default;
};

}  // namespace tubed
