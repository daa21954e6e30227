// Where the simulated vessel runs: a chain of circular arcs, closed form, smooth in its tangent.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace tubed {

/// One piece of constant curvature. Curvature 0 is a straight piece.
struct VesselPiece {
  double length_mm = 0;
  double curvature_per_mm = 0;
  double bend_direction_rad = 0;  ///< toward which it bends, about the tangent, from the chain's first normal
};

/// A position along the vessel with the direction in which arc length grows.
struct VesselPoint {
  Eigen::Vector3d p_world_mm;
  Eigen::Vector3d tangent_world;  ///< unit
};

/// A curve of unit speed in its arc length u, whatever the pieces; straight before the first and after the
/// last. Immutable, callable from any thread, at() never allocates.
class VesselCentreline {
 public:
  /// Starts at `start_mm` along `tangent`; `normal` is unit and at right angles to it.
  VesselCentreline(const Eigen::Vector3d& start_mm, const Eigen::Vector3d& tangent,
                   const Eigen::Vector3d& normal, const std::vector<VesselPiece>& pieces);

  [[nodiscard]] VesselPoint at(double u_mm) const;
  [[nodiscard]] double length_mm() const { return pieces_.back().u_start_mm; }

 private:
  struct PlacedPiece {
    double u_start_mm;
    double curvature_per_mm;
    Eigen::Vector3d start_mm;
    Eigen::Vector3d tangent;
    Eigen::Vector3d toward_centre;  ///< unit, the side to which the piece bends
  };

  static VesselPoint along(const PlacedPiece& piece, double length_mm);

  std::vector<PlacedPiece> pieces_;  ///< the last one is the straight continuation
};

}  // namespace tubed
