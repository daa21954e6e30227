// Which coils a filter believes: the gate in front of its EM updates.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "daemon/estimator/coils/coil_faults.hpp"
#include "daemon/estimator/coils/coil_innovations.hpp"
#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/coils/end_jumps.hpp"
#include "daemon/estimator/estimator_settings.hpp"

namespace tubed {

/// A coil that is less likely right than wrong (CoilFaults) takes no part, and comes back when it says the
/// same twice: what contradicts itself may be near the prediction by chance. Where coils contradict for long,
/// or the coils of one measurement alone name another one, the shape is what is wrong. Copied with the state;
/// never allocates.
class CoilGate {
 public:
  CoilGate(const EstimatorSettings& settings, int coil_count);

  /// Sets CoilObservation::belief of each coil to what was known before its measurement.
  void write_beliefs(CoilObservations& coils) const;

  /// Takes a measurement that was made at `time`, `interval_s` after the one before: `innovations` of `coils`
  /// against the prediction C. Those that are gated become kOutlier.
  void judge(const CoilInnovations& innovations, CoilFaults& faults, const UniformCubicBSpline& spline,
             const Eigen::Matrix3Xd& C, MonotonicTime time, double interval_s, CoilObservations& coils);

  /// Should the coils of this measurement be asked for a shape of their own, led by nothing older? Often
  /// while a beginning may have taken in what its own measurement did not show, now and then later.
  [[nodiscard]] bool asks_alone(MonotonicTime measured, double interval_s) const;

  /// Their answer: `alone` are the coils as SingleFrameSolver::solve_em() left them, `known` what it
  /// returned. `confirmed`: an image has just shown the tube where it was expected.
  void take_answer(bool known, const CoilObservations& alone, MonotonicTime measured, bool confirmed);

  /// When most coils contradict, the tube has snapped and they are right.
  [[nodiscard]] bool most_are_out() const;
  /// The coils have said that the shape is wrong.
  [[nodiscard]] bool shape_is_disowned() const { return shape_is_disowned_; }
  /// Is this coil, left out as it may be, a witness of a snap of the tube?
  [[nodiscard]] bool is_witness(int coil) const;

  /// What jumps of the end coils have left open.
  [[nodiscard]] const EndJumps& end_jumps() const { return end_jumps_; }

  /// Gated coils become kOutlier.
  void leave_out_gated(CoilObservations& coils) const;
  /// Nothing is begun with what contradicts itself, as long as there are others.
  void leave_out_erratic(CoilObservations& coils) const;

  /// A shape was found by these coils, of a measurement made at `measured`; outliers are marked.
  void begin(const CoilObservations& coils, MonotonicTime measured, MonotonicTime state_time);
  void own_shape() { shape_is_disowned_ = false; }
  /// There was a long silence.
  void forget_contradictions();
  void reset();

 private:
  /// What is held against a coil.
  struct Doubt {
    bool is_out = false;                    ///< of the newest measurement
    MonotonicTime since{};                  ///< steadily
    bool alone_as_well = false;             ///< the coils of an instant alone contradict it, too
    int cleared_times = 0;                  ///< in a row that they were asked and did not
    std::optional<Eigen::Vector3d> off_mm;  ///< the shape, the last time; world
    bool contradicts_itself = false;        ///< it said something else the time before
    bool jumped = false;   ///< it went wrong from one measurement to the next, and no other did
    bool whipped = false;  ///< the same of an end, where the tube may move so
  };

  void judge_coil(int coil, const Eigen::Vector3d& off_mm, MonotonicTime time, CoilObservations& coils);
  [[nodiscard]] bool is_end(int coil) const { return coil == 0 || coil + 1 == coil_count_; }
  [[nodiscard]] bool jumped_alone(int coil, const CoilInnovations& innovations) const;
  [[nodiscard]] bool is_young(MonotonicTime time) const;

  CoilFaultModel model_;
  double steady_mm2_;  ///< squared difference of two measurements of a coil that says the same twice, at most
  int coil_count_;
  CoilBeliefs beliefs_;
  std::array<Doubt, kMaxCoils> doubts_{};
  EndJumps end_jumps_;
  MonotonicTime began_{};  ///< EM frame of the beginning
  MonotonicTime asked_{};  ///< EM frame whose coils alone were last asked which is wrong
  bool shape_is_disowned_ = false;
};

}  // namespace tubed
