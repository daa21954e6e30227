// The recursive estimator's state moved on in time.
#pragma once

#include <Eigen/Core>

#include "daemon/estimator/images/line_verdicts.hpp"
#include "daemon/estimator/tube_motion.hpp"
#include "daemon/estimator/tube_state.hpp"

namespace tubed {

/// The tube moves as TubeMotion has it, and what stays of its coils' errors changes on the way. One an
/// estimator; memory is taken in the constructor.
class StateMotion {
 public:
  /// Both belong to the caller; the state's columns are those of `map`.
  StateMotion(const TubeMap& map, const InstrumentDescription& instrument);

  /// A tube of which nothing is known but where it is.
  void begin(TubeGaussian& tube) const { motion_.begin(tube.C, tube.P); }

  /// To `time`, a past one changes nothing. `freedom` of the sideways motion, before
  /// MotionFreedom::sideways().
  void predict(MonotonicTime time, double freedom, TubeState& state);

  /// An image shows that the tube has jerked to a side by so much more than was expected; `layout` is of the
  /// lines that show it. It may have gone as far in depth.
  void loosen(const Surprise& surprise, const LineLayout& layout, TubeState& state) const;

  /// Learns from an update, `interval_s` after the one before, how fast each stretch of the tube drifts.
  void learn_drift(double interval_s, TubeState& state) const;

  /// Of the tube along itself, toward its tip.
  [[nodiscard]] static double speed_mm_s(const TubeState& state) {
    return TubeMotion::speed_mm_s(state.tube.m);
  }

 private:
  const TubeMap& map_;
  const InstrumentDescription& instrument_;
  TubeMotion motion_;
  Eigen::MatrixXd scratch_;
};

}  // namespace tubed
