#include "daemon/estimator/state_motion.hpp"

namespace tubed {

StateMotion::StateMotion(const TubeMap& map, const InstrumentDescription& instrument)
    : map_(map),
      instrument_(instrument),
      motion_(map.spline(), map.columns().count()),
      scratch_(Eigen::MatrixXd::Zero(3 * Eigen::Index{map.columns().count()},
                                     3 * Eigen::Index{map.columns().count()})) {}

void StateMotion::predict(MonotonicTime time, double freedom, TubeState& state) {
  TubeGaussian& tube = state.tube;
  const double dt_s = seconds_between(tube.time, time);
  if (dt_s <= 0) {
    return;
  }
  tube.time = time;
  const double sideways = MotionFreedom::sideways(freedom, state.errors.share());
  motion_.predict(dt_s, {sideways, state.drift}, tube.C, tube.m, tube.P);
  state.errors.age(dt_s, instrument_, map_, tube, scratch_);
}

void StateMotion::loosen(const Surprise& surprise, const LineLayout& layout, TubeState& state) const {
  motion_.loosen([&](double s_mm) { return surprise.beyond_mm2_at(s_mm, layout); }, state.tube.P);
}

void StateMotion::learn_drift(double interval_s, TubeState& state) const {
  motion_.learn_drift(interval_s, MotionFreedom::min_drift(state.errors.share()), state.tube.m, state.tube.P,
                      state.drift);
}

}  // namespace tubed
