// What speaks against the shape of a filter: a shape of the instant alone that coils and images like better.
#pragma once

#include <memory>

#include "daemon/estimator/coils/coil_gate.hpp"
#include "daemon/estimator/single_frame_solver.hpp"

namespace tubed {

/// How often in a row such a shape knew better. Copied with the state.
class ShapeDoubt {
 public:
  /// Two images of one EM measurement are not two witnesses: the error of the coils is the same.
  void add(int witnesses, MonotonicTime newest_em);
  void clear() { times_ = 0; }
  void make_certain() { times_ = kCertain; }
  [[nodiscard]] bool any() const { return times_ > 0; }
  [[nodiscard]] bool is_certain() const { return times_ >= kCertain; }

 private:
  static constexpr int kCertain = 2;  ///< EM measurements in a row

  int times_ = 0;
  MonotonicTime newest_em_{};  ///< EM frame at the last of them
};

/// A shape that images show, and what its coils say of it.
struct ShownShape {
  const Eigen::Matrix3Xd& C;  ///< columns of `map`
  const TubeMap& map;
  const TubeViews& views;  ///< that were measured with it
  float agreeing;          ///< share of the lines that agree with it, 0 .. 1
  const CoilObservations& coils;
  const CoilGate& gate;
  MonotonicTime newest_em;
  bool lost_tail = false;  ///< its far end, which no coil holds, is not where the images show one
};

/// Images may lead the shape along something else, a little each time, and the errors of the coils grow with
/// it; or the tube has snapped to elsewhere. The coils of the instant, led by nothing older, and its image
/// tell. Called by the optimizer's thread; memory is taken in the constructor.
class ShapeJudge {
 public:
  /// `solver` belongs to the caller and is used here as scratch.
  ShapeJudge(const EstimatorSettings& settings, const InstrumentDescription& instrument,
             const RoomDescription& room, SingleFrameSolver& solver);

  /// The verdict on a shape that the images of this instant show, kShowsTube if nothing speaks against it.
  ImageVerdict judge(const Observation& observation, const ShownShape& shown, ShapeDoubt& doubt);

  /// A shape of these coils alone: SingleFrameSolver::solve_em().
  bool solve_em(CoilObservations& coils) { return solver_.solve_em(coils, *found_); }

 private:
  int coils_of_a_snap(const Observation& observation, const ShownShape& shown);
  bool is_better_alone(const Observation& observation, const ShownShape& shown, const CoilObservations& coils,
                       double distance);
  bool is_caught(const Observation& observation, const ShownShape& shown, double distance);
  [[nodiscard]] bool is_seen_elsewhere(const Observation& observation, const ShownShape& shown) const;
  [[nodiscard]] bool is_elsewhere(const Camera& camera, const ShownShape& shown) const;
  [[nodiscard]] double distance(const CoilObservations& coils, const TubeMap& map,
                                const Eigen::Matrix3Xd& C) const;

  double sigma_position_mm_;
  SingleFrameSolver& solver_;
  TubeViews views_;  ///< of the shape of the instant alone
  std::unique_ptr<TubeEstimate> found_;
};

}  // namespace tubed
