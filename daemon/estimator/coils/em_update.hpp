// One EM measurement taken into the state of the recursive estimator: gated, then Kalman's update.
#pragma once

#include "daemon/estimator/coils/coil_faults.hpp"
#include "daemon/estimator/coils/coil_update.hpp"
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

  /// Takes the used coils in. False when the state is lost: its covariance is not positive definite, or what
  /// coils say is kAstray times as unlikely as noise, twice running, which no motion and no fault of a coil
  /// that was let through explains.
  bool take(const CoilObservations& coils, TubeState& state);

  static constexpr double kAstray = 100;  ///< chi^2 over its expectation

  /// Of the newest take().
  [[nodiscard]] const CoilUpdate::Pull& pull() const { return update_.pull(); }

 private:
  const TubeMap& map_;
  CoilFaults faults_;
  CoilInnovations innovations_;
  CoilUpdate update_;
  int astray_ = 0;  ///< updates, one after the other
};

}  // namespace tubed
