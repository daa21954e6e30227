// The vessel that the catheter is pushed through: its wall, its way in and its way along.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "drivers/laboratory/vessel/wall_field.hpp"

namespace tubed {

/// Where and in which direction the catheter enters.
struct Introducer {
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit, inward
  /// Unit, at right angles to `direction`: where roll 0 bends the tip to, as seen at the introducer.
  Eigen::Vector3d reference = Eigen::Vector3d::UnitX();
};

/// A place along the vessel.
struct VesselStation {
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;
};

/// One vessel. `route` runs from the introducer to the target (the aortic valve), about every mm.
struct Vessel {
  WallField wall;
  Introducer introducer;
  std::vector<VesselStation> route;

  /// Along the route, from the introducer to the target.
  [[nodiscard]] double route_length_mm() const;
  /// The place nearest to `u_mm` along the route, by linear interpolation; clamped to its ends.
  [[nodiscard]] Eigen::Vector3d route_point(double u_mm) const;
};

/// Balls that fill a tube along `stations`, dense enough that the wall between two is off by less than 0.02
/// mm for radii above 3 mm.
void append_tube(const std::vector<VesselStation>& stations, std::vector<LumenBall>& balls);

}  // namespace tubed
