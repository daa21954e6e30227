// The simulated EM tracker as a function of time, for the live source and for sequence folders alike.
#pragma once

#include <cstdint>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "drivers/laboratory/tracker/em_errors.hpp"
#include "drivers/laboratory/tracker/generator_motion.hpp"
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

  /// Sensor `index` of the room's reference in the same measurement; of one alone all six degrees of freedom.
  [[nodiscard]] CoilSample measure_reference(const SimulatedWorld& world, std::size_t index, std::int64_t k,
                                             double t_s) const noexcept;

  /// All coils and the reference of the room; returns the highest sensor among them.
  int measure_all(const SimulatedWorld& world, std::int64_t k, double t_s,
                  std::array<CoilSample, kMaxTrackerCoils>& coils) const noexcept;

 private:
  [[nodiscard]] RigidTransform T_em_world(double t_s) const noexcept {
    return generator_.T_rest_em(t_s).inverse() * T_em_world_;
  }

  double period_s_;
  RigidTransform T_em_world_;  ///< the true one, which a preset may keep from the daemon; generator at rest
  GeneratorMotion generator_;
  EmErrors errors_;
  double jump_s_;      ///< from then on the field is bent by `jump_`, too; infinite: never
  SmoothField jump_;   ///< displacement, tracker's frame
  double toward_tip_;  ///< 1; -1 where tangents are mistaken for their opposites
};

}  // namespace tubed
