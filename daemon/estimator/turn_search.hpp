// How may a view have been turned while no image showed it?
#pragma once

#include <array>
#include <cstddef>

#include "daemon/estimator/view_pose.hpp"

namespace tubed {

/// A pose with which an image shows the tube where coils say that it is.
struct PoseMatch {
  ViewPose pose;
  double log_evidence = 0;
  bool is_found = false;
};

/// Where to begin looking for the pose of a view that moved unseen: a pan, turns about the axis that is
/// vertical in the image, tilts about the horizontal one; and the best of what was found of each. Called by
/// the optimizer thread; takes no memory.
class TurnSearch {
 public:
  enum Move : std::size_t { kPan, kTurn, kTilt, kMoves };

  /// One of them. What is known does not depend on it: the pose before, give or take such a move.
  struct Start {
    std::size_t move = kPan;
    ViewPose pose;             ///< where to begin, with the covariance of what is known
    ViewPose::Error expected;  ///< of that pose, by what is known
  };

  /// `before`: the pose before the view moved.
  void begin(const ViewPose& before);
  [[nodiscard]] bool is_over() const;
  /// The next one. Precondition: !is_over().
  [[nodiscard]] Start next();

  void add(std::size_t move, const PoseMatch& found);
  /// The likeliest of that move since begin(); is_found is false where there was none.
  [[nodiscard]] const PoseMatch& best(std::size_t move) const { return best_[move]; }
  [[nodiscard]] bool has_found() const;

 private:
  ViewPose before_;
  std::size_t move_ = kMoves;
  int step_ = 0;
  std::array<PoseMatch, kMoves> best_;
};

}  // namespace tubed
