// A field generator that is pushed and drifts while a simulated catheter is tracked, and the reference on the
// patient by which that is noticed.
#pragma once

#include <array>

#include "drivers/interface/driver_settings.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// How the generator moves in its own frame at rest. The same for all seeds.
struct GeneratorMotion {
  double shift_mm = 0;  ///< it is pushed so far
  double turn_rad = 0;  ///< and turned about itself
  double at_s = 5;      ///< when that begins
  double push_s = 0.3;  ///< how long it takes
  double drift_mm_s = 0;

  /// Where it is: p_rest = T_rest_em * p_em. Identity when nothing moves.
  [[nodiscard]] RigidTransform T_rest_em(double t_s) const;
};

/// The generator's keys of the simulation.
GeneratorMotion generator_motion(const DriverSettings& settings);

/// Where the reference is on the patient, who does not move: 70 mm beside, 40 mm below and 60 mm behind the
/// world's origin, its axes those of the world.
RigidTransform T_world_reference();

/// Two coils on the same body: 30 mm apart along its x axis, the first one's axis along z, the second one's
/// along y.
struct ReferenceCoil {
  Eigen::Vector3d p_reference_mm;
  Eigen::Vector3d axis_reference;
};
std::array<ReferenceCoil, 2> coils_of_reference();

}  // namespace tubed
