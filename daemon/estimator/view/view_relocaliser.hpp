// Where does a view stand that moved without a word? The catheter is the phantom: coils say where it is in
// the world, the image where it is in the picture.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "daemon/estimator/agreement/room_errors.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/view/move_hypotheses.hpp"
#include "daemon/estimator/view/pose_in_use.hpp"
#include "daemon/estimator/view/pose_matcher.hpp"
#include "daemon/estimator/view/turn_search.hpp"
#include "daemon/estimator/view/view_pose.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Follows the pose of one camera: PoseMatcher reads images, MoveHypotheses are what may have happened,
/// PoseInUse watches over what was found. While the view moves its pose may go as fast as tables and C-arms
/// do; once it has settled it stays, and each image of a tube that lies elsewhere than before says more of
/// it. Where the view moved while fluoroscopy was off, and the background does not say that it panned, or
/// where no hypothesis has the tube in the image, or a pose in use does not show it any more, turns of up to
/// 60 degrees are tried one after another (TurnSearch), and each hypothesis goes on from its likeliest.
/// Called by the optimizer thread; memory is taken in the constructor.
class ViewRelocaliser {
 public:
  /// The camera of that index in the room, as measured_room() has it.
  ViewRelocaliser(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                  const RoomDescription& room, std::size_t camera);

  enum class State {
    kGiven,  ///< it stands where configuration or image says
    kLost,   ///< it moved, and is being looked for
    kFound,  ///< its images may be used, with pose()
  };
  [[nodiscard]] State state() const { return state_; }

  /// Image and verdict of a view that is not where its pose says. `shape`: without that image, of its
  /// instant.
  void observe(const MovedImage& moved, const TubeEstimate& shape);

  /// After observe() with the same image: tries a few turns where the tube is not found.
  void look_further(const MovedImage& moved);

  /// Before an image is used: does the pose still hold? False when it moved again.
  bool holds(const MovedImage& moved);

  /// An image that was used for `estimate`: once found a pose gets better with every place the tube goes to.
  /// `by_coils`: the shape of that instant by coils alone, since one that images led would agree with the
  /// pose that they were shown with.
  void refine(const MovedImage& moved, const TubeEstimate& estimate, const TubeEstimate& by_coils);

  /// `image` was shown with pose() to the estimator that made that estimate. Gives the pose up, and looks for
  /// another one, where the tube has not been seen with it for a second.
  void judge_use(const ImageMeasurement& image, const TubeEstimate& estimate);

  /// Of kLost and kFound. It was found against coils: what is open of the registration is open of it, and
  /// no number of images makes that less.
  [[nodiscard]] ViewPose pose() const;

  /// What the pose leaves open across the view, the registration aside, where it looks at: standard
  /// deviation, root mean square over both axes.
  [[nodiscard]] double sigma_across_mm() const { return sigma_across_mm_; }

  /// The view is where its pose says.
  void forget();

  /// As forget(), and no image was ever seen.
  void reset();

  /// Before all else at any image of the view.
  void note_image(MonotonicTime exposure);

 private:
  /// The newest one.
  struct Move {
    std::uint32_t number = 0;  ///< as the watch of the view counts
    MonotonicTime since{};
    MonotonicTime last{};      ///< image of it
    bool has_settled = false;  ///< the view stands again
    bool is_told = false;      ///< the background says how it moved
    bool was_unseen = false;   ///< what images show of it is not all
  };

  struct Times {
    MonotonicTime shape{};    ///< instant of the newest one that observe() took
    MonotonicTime image{};    ///< the newest one
    MonotonicTime resumed{};  ///< the first image after a while without
  };

  void begin(const MovedImage& moved);
  void lose(bool was_unseen);
  void settle(const MovedImage& moved);
  void choose(MonotonicTime exposure);
  void take_pose();
  [[nodiscard]] bool is_known_well() const;

  std::size_t camera_;
  ViewGeometry configured_;
  RoomErrors errors_;
  double pivot_depth_mm_;
  PoseMatcher matcher_;
  MoveHypotheses hypotheses_;
  TurnSearch search_;
  PoseInUse use_;
  State state_ = State::kGiven;
  Move move_;
  ViewPose before_;  ///< the pose before that, or that was given up
  ViewPose pose_;    ///< of the likeliest one, against the coils as registered
  Times times_;
  Eigen::Matrix3Xd here_mm_;  ///< where the tube is while the pose is refined
  double sigma_across_mm_ = 0;
};

}  // namespace tubed
