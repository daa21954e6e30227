#include "daemon/estimator/coils/em_update.hpp"

namespace tubed {

EmUpdate::EmUpdate(const EstimatorSettings& settings, const TubeMap& map, int coil_count)
    : map_(map),
      faults_(settings.coil_faults, coil_count),
      innovations_(coil_count),
      update_(coil_count, map.columns().count()) {}

double EmUpdate::gate(MonotonicTime measured, double interval_s, TubeState& state, CoilObservations& coils) {
  innovations_.measure(coils, map_, state.tube, state.errors.noise().noise_position_mm());
  state.gate.judge(innovations_, faults_, map_.spline(), state.tube.C, measured, interval_s, coils);
  return innovations_.surprise();
}

bool EmUpdate::take(const CoilObservations& coils, TubeState& state) {
  const CoilNoise& noise = state.errors.noise();
  TubeGaussian& tube = state.tube;
  if (!update_.apply(coils, map_, noise.noise_position_mm(), noise.noise_tangent(), tube.C, tube.m, tube.P)) {
    return false;
  }
  astray_ = pull().chi_squared > kAstray * pull().expected ? astray_ + 1 : 0;
  if (astray_ < 2) return true;
  astray_ = 0;
  return false;
}

}  // namespace tubed
