// The simulated EM tracker as a function of time, for the live source and for sequence folders alike.
#pragma once

#include <cstdint>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "drivers/laboratory/tracker/em_errors.hpp"
#include "drivers/laboratory/tracker/smooth_field.hpp"

namespace tubed {

/// Measures the coils of all catheters of a world, with the errors of its preset or, for "arch", the noise of
/// Eq. (19)-(20), and what the world's mistakes do to them. Immutable, callable from any thread, measure()
/// never allocates.
class SimulatedTracker {
 public:
  /// `settings`: seed, lambda_mm and psi_deg are used here. `period_s` between two measurements.
  SimulatedTracker(const SimulatedWorld& world, const DriverSettings& settings, double period_s);

  /// One coil in measurement number k, taken `t_s` seconds after the epoch.
  [[nodiscard]] CoilSample measure(const SimulatedWorld& world, int instrument, const CoilPlacement& coil,
                                   std::int64_t k, double t_s) const noexcept;

 private:
  double period_s_;
  RigidTransform T_em_world_;  ///< the true one, which a preset may keep from the daemon
  EmErrors errors_;
  double jump_s_;      ///< from then on the field is bent by `jump_`, too; infinite: never
  SmoothField jump_;   ///< displacement, tracker's frame
  double toward_tip_;  ///< 1; -1 where tangents are mistaken for their opposites
};

}  // namespace tubed
