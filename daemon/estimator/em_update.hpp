// One EM measurement taken into the state of the recursive estimator: gated, then Kalman's update.
#pragma once

#include "daemon/estimator/coil_faults.hpp"
#include "daemon/estimator/coil_update.hpp"
#include "daemon/estimator/tube_state.hpp"

namespace tubed {

/// One an estimator; memory is taken in the constructor.
class EmUpdate {
 public:
  /// The state's columns are those of `map`, which belongs to the caller.
  EmUpdate(const EstimatorSettings& settings, const TubeMap& map, int coil_count);

  /// Gates the coils of a measurement made at `measured`, `interval_s` after the one before, against the
  /// state predicted to its time. Gives CoilInnovations::surprise().
  double gate(MonotonicTime measured, double interval_s, TubeState& state, CoilObservations& coils);

  /// Takes the used coils in. False when the covariance is not positive definite: the state is lost.
  bool take(const CoilObservations& coils, TubeState& state);

  /// Of the newest take().
  [[nodiscard]] const CoilUpdate::Pull& pull() const { return update_.pull(); }

 private:
  const TubeMap& map_;
  CoilFaults faults_;
  CoilInnovations innovations_;
  CoilUpdate update_;
};

}  // namespace tubed
