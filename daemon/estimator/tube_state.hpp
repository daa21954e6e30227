// All that the recursive estimator knows at a time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "daemon/estimator/coils/coil_gate.hpp"
#include "daemon/estimator/coils/common_jump.hpp"
#include "daemon/estimator/coils/lasting_coil_errors.hpp"
#include "daemon/estimator/coils/loose_ends.hpp"
#include "daemon/estimator/images/shape_judge.hpp"
#include "daemon/estimator/motion_freedom.hpp"
#include "daemon/estimator/tube_gaussian.hpp"
#include "daemon/estimator/tube_motion.hpp"

namespace tubed {

/// What the newest images said of the tube.
struct ImageRecord {
  explicit ImageRecord(int coefficient_count) : rival(Eigen::Matrix3Xd::Zero(3, coefficient_count)) {}

  int without_tube = 0;        ///< in a row that showed no tube
  int with_tube = 0;           ///< in a row, as many as confirm a short piece at most
  bool tip_is_missed = false;  ///< the newest one that showed the tube did not show its tip there
  bool contradicted = false;   ///< the newest one pulled the shape further off the coils than they err
  MonotonicTime confirmed{};   ///< newest one that showed the tube where it was expected; zero: none
  Eigen::Matrix3Xd rival;      ///< MirrorTest::rival() of that one
  bool is_ambiguous = false;   ///< the same of MirrorTest::is_ambiguous()

  static constexpr int kLostAfter = 3;  ///< images without the tube
  [[nodiscard]] bool have_lost_tube() const { return without_tube >= kLostAfter; }
  [[nodiscard]] bool confirm_at(MonotonicTime time) const {
    constexpr double kConfirmedFor_s = 0.5;
    return to_ns(confirmed) != 0 && seconds_between(confirmed, time) < kConfirmedFor_s;
  }
  void forget_rival() {
    rival.setZero();
    is_ambiguous = false;
  }
};

/// Copied without allocating.
struct TubeState {
  TubeState(const TubeMap& map, const EstimatorSettings& settings, int coil_count)
      : tube(map.columns().count()),
        errors(settings),
        gate(settings, coil_count),
        bending(Eigen::VectorXd::Ones(map.bending_node_count())),
        images(settings.coefficient_count) {}

  bool begun = false;
  MonotonicTime newest_em{};  ///< measurement time of the newest EM frame used
  TubeGaussian tube;
  LastingCoilErrors errors;
  CoilGate gate;
  CommonJump common_jump;
  LooseEnds loose_ends;
  MotionFreedom freedom;
  TubeMotion::DriftVariances drift;
  Eigen::VectorXd bending;         ///< how much the tube bends, as TubeMap::set_bending() takes it
  MonotonicTime bending_learnt{};  ///< when it was last learnt
  ImageRecord images;
  ShapeDoubt doubt;

  /// Has so much spoken against the shape that one has to be found anew?
  [[nodiscard]] bool is_lost() const {
    return gate.most_are_out() || gate.shape_is_disowned() || images.have_lost_tube() || doubt.is_certain();
  }
  /// Every doubt, and all that was learnt of how the tube moves and bends.
  void forget_doubts();
};

/// The states after the newest updates: an image may arrive after younger EM measurements.
class StateHistory {
 public:
  explicit StateHistory(const TubeState& like) : past_{like, like, like, like, like, like, like, like} {}

  void remember(const TubeState& state) {
    past_[next_] = state;
    next_ = (next_ + 1) % past_.size();
  }

  /// `state` becomes the newest one that is not younger than `time`, and younger ones are forgotten: they
  /// have not seen what comes now. Without such a one everything stays.
  void go_back(MonotonicTime time, TubeState& state);
  void forget();

 private:
  std::array<TubeState, 8> past_;  ///< a ring
  std::size_t next_ = 0;
};

}  // namespace tubed
