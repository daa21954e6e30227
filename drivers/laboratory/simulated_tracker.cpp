#include "drivers/laboratory/simulated_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tubed {

namespace {

constexpr std::int64_t kJumpStream = 7302;

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

double jump_s(const SimulatedWorld& world) {
  const RoomMistakes& mistakes = world.mistakes();
  return mistakes.field_jump_mm > 0 ? mistakes.field_jump_s.value_or(world.half_way_s())
                                    : std::numeric_limits<double>::infinity();
}

}  // namespace

SimulatedTracker::SimulatedTracker(const SimulatedWorld& world, const DriverSettings& settings,
                                   double period_s)
    : period_s_(period_s),
      T_em_world_(true_T_em_world(world)),
      generator_(generator_motion(settings)),
      errors_(errors_of(world, settings)),
      jump_s_(jump_s(world)),
      jump_(settings.get<std::int64_t>("seed"), kJumpStream, world.mistakes().field_jump_mm,
            working_volume_mm(T_em_world_)),
      toward_tip_(world.mistakes().flips_coils ? -1 : 1) {}

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
  const RigidTransform T = T_em_world(t_s);
  const Eigen::Vector3d p_em_mm = T * world.point(instrument, t_s, coil.offset_from_tip_mm);
  const Eigen::Vector3d tangent_em = T.linear() * world.tangent(instrument, t_s, coil.offset_from_tip_mm);
  CoilSample sample = errors_.measure(coil.sensor, k, scenario_s, p_em_mm, tangent_em);
  if (t_s >= jump_s_) {
    // Space is bent, u(p), and directions with it: t + (du/dp) t.
    sample.p_em_mm += jump_.at(p_em_mm);
    sample.tangent_em = (sample.tangent_em + jump_.gradient(p_em_mm) * sample.tangent_em).normalized();
  }
  sample.tangent_em *= coil.flipped ? -toward_tip_ : toward_tip_;
  return sample;
}

CoilSample SimulatedTracker::measure_reference(const SimulatedWorld& world, std::size_t index, std::int64_t k,
                                               double t_s) const noexcept {
  const ReferenceDescription& reference = *world.room().reference;
  const double scenario_s = world.scenario_time_s(t_s);
  const int sensor = reference.sensors[index];
  const RigidTransform T_em_reference = T_em_world(t_s) * T_world_reference();
  if (reference.has_two_coils()) {
    const ReferenceCoil coil = coils_of_reference().at(index);
    return errors_.measure(sensor, k, scenario_s, T_em_reference * coil.p_reference_mm,
                           T_em_reference.linear() * coil.axis_reference);
  }
  CoilSample sample =
      errors_.measure(sensor, k, scenario_s, T_em_reference.translation(), T_em_reference.linear().col(2));
  // Another draw for the turn about z; of a coil's axis it takes the same errors.
  constexpr int kTurnStream = 100;
  const CoilSample turned = errors_.measure(kTurnStream + sensor, k, scenario_s, T_em_reference.translation(),
                                            T_em_reference.linear().col(0));
  const bool is_measured = sample.status == CoilStatus::kOk;
  sample.x_axis_em =
      turned.status == CoilStatus::kOk || !is_measured ? turned.tangent_em : T_em_reference.linear().col(0);
  return sample;
}

int SimulatedTracker::measure_all(const SimulatedWorld& world, std::int64_t k, double t_s,
                                  std::array<CoilSample, kMaxTrackerCoils>& coils) const noexcept {
  int coil_count = 0;
  const auto put = [&](int sensor, const CoilSample& sample) {
    coils[static_cast<std::size_t>(sensor - 1)] = sample;
    coil_count = std::max(coil_count, sensor);
  };
  const RoomDescription& room = world.room();
  for (std::size_t instrument = 0; instrument < room.instruments.size(); ++instrument) {
    for (const CoilPlacement& coil : room.instruments[instrument].coils) {
      if (coil.sensor >= 1 && coil.sensor <= kMaxTrackerCoils) {
        put(coil.sensor, measure(world, static_cast<int>(instrument), coil, k, t_s));
      }
    }
  }
  for (std::size_t i = 0; room.reference && i < room.reference->sensors.size(); ++i) {
    put(room.reference->sensors[i], measure_reference(world, i, k, t_s));
  }
  return coil_count;
}

}  // namespace tubed
