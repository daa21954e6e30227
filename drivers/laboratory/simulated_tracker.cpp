#include "drivers/laboratory/simulated_tracker.hpp"

#include <cmath>
#include <numbers>

namespace tubed {

namespace {

RigidTransform true_T_em_world(const SimulatedWorld& world) {
  const Scenario* scenario = world.scenario();
  const RigidTransform& given = world.room().T_world_em;
  return scenario == nullptr ? given.inverse() : (given * scenario->registration_error).inverse();
}

EmErrors errors_of(const SimulatedWorld& world, const DriverSettings& settings) {
  const Scenario* scenario = world.scenario();
  const auto seed = settings.get<std::int64_t>("seed");
  if (scenario != nullptr) {
    return {scenario->em, seed, working_volume_mm(true_T_em_world(world))};
  }
  EmErrorSettings errors;
  errors.lambda_mm = settings.get<double>("lambda_mm");
  errors.psi_rad = settings.get<double>("psi_deg") * std::numbers::pi / 180;
  return {errors, seed, {}};
}

}  // namespace

SimulatedTracker::SimulatedTracker(const SimulatedWorld& world, const DriverSettings& settings,
                                   double period_s)
    : period_s_(period_s), T_em_world_(true_T_em_world(world)), errors_(errors_of(world, settings)) {}

CoilSample SimulatedTracker::measure(const SimulatedWorld& world, int instrument, const CoilPlacement& coil,
                                     std::int64_t k, double t_s) const noexcept {
  double scenario_s = world.scenario_time_s(t_s);
  if (const auto since_s = errors_.stuck_since_s(coil.sensor, scenario_s)) {
    // The last measurement before it got stuck.
    const double periods = std::floor((scenario_s - *since_s) / period_s_) + 1;
    k -= static_cast<std::int64_t>(periods);
    t_s -= periods * period_s_;
    scenario_s -= periods * period_s_;
  }
  const Eigen::Vector3d p_em_mm = T_em_world_ * world.point(instrument, t_s, coil.offset_from_tip_mm);
  const Eigen::Vector3d tangent_em =
      T_em_world_.linear() * world.tangent(instrument, t_s, coil.offset_from_tip_mm);
  CoilSample sample = errors_.measure(coil.sensor, k, scenario_s, p_em_mm, tangent_em);
  sample.tangent_em *= coil.flipped ? -1 : 1;
  return sample;
}

}  // namespace tubed
