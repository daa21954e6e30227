// Where the filter begins, and begins again: a shape of one instant becomes mean and covariance of the state.
#pragma once

#include <span>

#include "daemon/estimator/single_frame_solver.hpp"
#include "daemon/estimator/state_motion.hpp"
#include "daemon/estimator/tube_map.hpp"
#include "daemon/estimator/tube_state.hpp"

namespace tubed {

/// Of one instrument. Called by the optimizer thread; memory is taken in the constructor.
class ShapeBeginning {
 public:
  ShapeBeginning(const EstimatorSettings& settings, const InstrumentDescription& instrument);

  /// As TubeMap::set_rest().
  void set_rest(RestHook* hook);

  /// That finds the shape of the instant.
  [[nodiscard]] SingleFrameSolver& solver() { return solver_; }
  /// Of all columns of the state.
  [[nodiscard]] const TubeMap& map() const { return map_; }

  /// Nothing is known of the coils' errors but how large they may be: zero each, and what is thought to stay
  /// of them as standard deviation.
  void suppose_coil_errors(TubeState& state);

  struct Begun {
    bool is_possible = false;  ///< the covariance is positive definite
    int iterations = 0;
    bool converged = false;
  };
  /// Mean and covariance of what was measured, without the tube's stiffness, from the shape that solver() has
  /// found, into the state.
  Begun begin_with(const CoilObservations& coils, std::span<const ViewConstraints> lines, StateMotion& motion,
                   TubeState& state);

  /// The covariance of the shape C with its stiffness; nullptr when it cannot be had.
  const TubeMap* covariance_of(const Eigen::Matrix3Xd& C, const CoilObservations& coils,
                               std::span<const ViewConstraints> lines) {
    return map_.invert_at(coils, lines, &prior_, C) ? &map_ : nullptr;
  }

 private:
  int max_iterations_;
  SingleFrameSolver solver_;
  TubeMap map_;
  GaussianPrior prior_;
};

}  // namespace tubed
