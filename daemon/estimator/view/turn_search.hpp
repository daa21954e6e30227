// How may a view have been turned while no image showed it?
#pragma once

#include <array>
#include <cstddef>

#include "daemon/estimator/view/view_pose.hpp"

namespace tubed {

/// Where to begin looking for the pose of a view that moved unseen: a pan, turns about the axis that is
/// vertical in the image, tilts about the horizontal one; and the best of what was found of each. Called by
/// the optimizer thread; takes no memory. A catheter that is not in the picture is looked for in vain:
/// after each such search the next one waits twice as long.
class TurnSearch {
 public:
  enum Move : std::size_t { kPan, kTurn, kTilt, kMoves };

  /// One of them. What is known does not depend on it: the pose before, give or take such a move.
  struct Start {
    std::size_t move = kPan;
    ViewPose pose;             ///< where to begin, with the covariance of what is known
    ViewPose::Error expected;  ///< of that pose, by what is known
  };

  /// Nothing is looked for, and the first search waits for 16 images without the tube.
  void forget();
  /// One of a view that stands: begins when the tube was astray in enough of them in a row. `before`: see
  /// begin().
  void note_image(bool is_astray, const ViewPose& before);
  /// `before`: the pose before the view moved.
  void begin(const ViewPose& before);
  /// After it the next one waits as the first one does where the tube was found, otherwise twice as long.
  void end();
  [[nodiscard]] bool is_running() const { return is_running_; }
  /// Everything was tried.
  [[nodiscard]] bool is_over() const;
  /// The next one. Precondition: !is_over().
  [[nodiscard]] Start next();

  void add(std::size_t move, const PoseMatch& found);
  /// The likeliest of that move since begin(); is_found is false where there was none.
  [[nodiscard]] const PoseMatch& best(std::size_t move) const { return best_[move]; }
  [[nodiscard]] bool has_found() const;

 private:
  static constexpr int kFirstWait = 16;  ///< images
  static constexpr int kLastWait = 512;

  int astray_ = 0;  ///< images in a row
  int wait_ = kFirstWait;
  bool is_running_ = false;
  ViewPose before_;
  std::size_t move_ = kMoves;
  int step_ = 0;
  std::array<PoseMatch, kMoves> best_;
};

}  // namespace tubed
