// What may have happened to a view that moved without a word, and how likely each of it is.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "daemon/estimator/view/pose_matcher.hpp"
#include "daemon/estimator/view/turn_search.hpp"
#include "daemon/estimator/view/view_pose.hpp"
#include "daemon/image/view_watch.hpp"

namespace tubed {

/// Three poses of one view, each followed by an iterated extended Kalman filter: the table panned, the C-arm
/// turned about the axis that is vertical in the image, or about the horizontal one. One image of a smooth
/// tube does not tell these apart; their evidence over the images of a catheter that moves does, and a
/// background that went all the same way. Images between which the tube has gone by less than 20 mm count as
/// one. Called by the optimizer thread; memory is taken in the constructor.
class MoveHypotheses {
 public:
  explicit MoveHypotheses(Eigen::Index line_count);

  /// All begin at `pose`, and what was open of it stays open.
  void suppose(const ViewPose& pose);
  /// All begin anew where a search found the tube; one for which it found none stays as it is, unlikely.
  /// `points_mm`: of the shape that was looked for. Precondition: search.has_found().
  void suppose_found(const TurnSearch& search, const Eigen::Matrix3Xd& points_mm);
  /// Does the background say by itself how the view moved?
  static bool tells(const BackgroundMotion& motion);
  /// It went as the background says, and the others are unlikely. `geometry`: before the move, whose pose
  /// pivots at `pivot_depth_mm`. Precondition: tells(motion).
  void suppose_told(const BackgroundMotion& motion, ViewGeometry geometry, double pivot_depth_mm);

  /// The view moves, for `moved_s` by now, and `dt_s` have passed.
  void move_on(double dt_s, double moved_s);
  /// It has come to rest.
  void settle();

  /// By an image against the matcher's shape, and which of them is the likeliest now.
  void correct(PoseMatcher& matcher, const MovedImage& moved, bool has_settled);
  /// The likeliest alone, by an image that counts as the share `news` of a new one. `here_mm`: where the tube
  /// is.
  void refine(PoseMatcher& matcher, const MovedImage& moved, double news, const Eigen::Matrix3Xd& here_mm);

  [[nodiscard]] const ViewPose& likeliest() const { return hypotheses_[likeliest_].pose; }
  /// 0 to 1: is the tube elsewhere than when the likeliest one was corrected last?
  [[nodiscard]] double news_of(const Eigen::Matrix3Xd& points_mm) const;
  /// The likeliest one has had the tube where it expected it for eight images.
  [[nodiscard]] bool is_steady() const { return has_tube(hypotheses_[likeliest_]); }
  /// Any has.
  [[nodiscard]] bool have_tube() const;
  /// None is nearly as likely as the likeliest and has the tube, at those points, elsewhere in the image.
  [[nodiscard]] bool are_decided(const Eigen::Matrix3Xd& points_mm) const;

  /// An image says so much less than this that it is waited for a better one.
  static constexpr double kWorthwhileNews = 0.1;

  /// Of a place of the tube against another: 1 where they are 20 mm apart or more.
  static double news_between(const Eigen::Matrix3Xd& a_mm, const Eigen::Matrix3Xd& b_mm);

 private:
  struct Hypothesis {
    ViewPose pose;
    ViewPose::Error growth = ViewPose::Error::Zero();  ///< how fast it may go while it moves, a second
    double log_evidence = 0;
    int good = 0;                     ///< images in a row in which the tube was found where it was expected
    bool has_used = false;            ///< an image
    Eigen::Matrix3Xd points_used_mm;  ///< of the shape, when the pose was corrected last
  };

  static void correct(PoseMatcher& matcher, const MovedImage& moved, double news, bool is_worthwhile,
                      Hypothesis& hypothesis);
  [[nodiscard]] static double news_for(const Hypothesis& hypothesis, const Eigen::Matrix3Xd& points_mm);
  [[nodiscard]] static bool has_tube(const Hypothesis& hypothesis) { return hypothesis.good >= kGoodInARow; }

  static constexpr int kGoodInARow = 8;
  std::array<Hypothesis, TurnSearch::kMoves> hypotheses_;
  std::size_t likeliest_ = 0;
};

}  // namespace tubed
