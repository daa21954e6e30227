// Where does a view stand that moved without a word? The catheter is the phantom: coils say where it is in
// the world, the image where it is in the picture.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/room_errors.hpp"
#include "daemon/estimator/tube_views.hpp"
#include "daemon/estimator/turn_search.hpp"
#include "daemon/estimator/view_pose.hpp"
#include "daemon/image/projected_lines.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Follows the pose of one camera, six numbers with a covariance, by an iterated extended Kalman filter,
/// thrice: the table panned, the C-arm turned about the axis that is vertical in the image, or about the
/// horizontal one. One image of a smooth tube does not tell these apart; their evidence over the images of a
/// catheter that moves does, and a background that went all the same way. While the view moves its pose may
/// go as fast as tables and C-arms do; once it has settled it stays, and each image of a tube that lies
/// elsewhere than before says more of it. Where an image shows the tube, and its end, TubeViews measures
/// around the projection of the shape that is known without that image. That shape's errors last and are
/// shared along the tube: lines within 40 mm of it count as one, and so do images between which it has gone
/// by less than 20 mm. Where the view moved while fluoroscopy was off, and the background does not say that
/// it panned, or where no hypothesis has the tube in the image, turns of up to 60 degrees are tried one after
/// another (TurnSearch), and each hypothesis goes on from its likeliest. Called by the optimizer thread;
/// memory is taken in the constructor.
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

  /// `image` was shown with pose() to the estimator that made that estimate.
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
  /// What may have happened: a pose each.
  struct Hypothesis {
    ViewPose pose;
    ViewPose::Error growth = ViewPose::Error::Zero();  ///< how fast it may go while it moves, a second
    double log_evidence = 0;
    int good = 0;                     ///< images in a row in which the tube was found where it was expected
    bool has_used = false;            ///< an image
    Eigen::Matrix3Xd points_used_mm;  ///< of the shape, when the pose was corrected last
  };

  using enum TurnSearch::Move;

  /// sum (o_i - H_i e)^2 / R_i = squares - 2 b^T e + e^T N e.
  struct LeastSquares {
    ViewPose::Covariance N = ViewPose::Covariance::Zero();
    ViewPose::Error b = ViewPose::Error::Zero();
    double squares = 0;
  };

  void begin(const MovedImage& moved);
  void settle(const MovedImage& moved);
  bool take_shape(const TubeEstimate& shape);
  void suppose();
  void move_on(double dt_s);
  void correct(const MovedImage& moved, Hypothesis& hypothesis);
  void correct(const MovedImage& moved, double news, Hypothesis& hypothesis);
  [[nodiscard]] double news_for(const Hypothesis& hypothesis) const;
  [[nodiscard]] double news_for_refinement() const;
  void choose(MonotonicTime exposure);
  void note_astray(MonotonicTime exposure);
  void begin_search();
  [[nodiscard]] bool is_searching() const { return astray_ >= kAstray; }
  void suppose_found();
  [[nodiscard]] bool is_known_well() const;
  [[nodiscard]] bool is_decided(const Hypothesis& better) const;
  [[nodiscard]] PoseMatch match(const MovedImage& moved, const ViewPose& prior, double news,
                                const ViewPose::Error& expected = ViewPose::Error::Zero());
  const ViewConstraints* look(const MovedImage& moved, const ViewPose& pose, int reach_px);
  [[nodiscard]] LeastSquares linearise(const ViewConstraints& view, const ViewPose& pose,
                                       const ViewPose::Error& e, double news) const;
  void note_sigma();
  [[nodiscard]] int reach_px(const ViewPose& pose) const;
  [[nodiscard]] std::size_t place_of(double s_mm) const;

  std::array<UniformCubicBSpline, 2> splines_;   ///< that shapes may have: of straight tubes, and of hooks
  const UniformCubicBSpline* spline_ = nullptr;  ///< that of the newest shape
  LineLayout layout_;
  std::size_t camera_;
  ViewGeometry configured_;
  RoomErrors errors_;
  double pivot_depth_mm_;
  TubeViews views_;  ///< of this camera alone
  Observation looked_at_;
  std::unique_ptr<TubeEstimate> scratch_;    ///< what TubeViews writes
  Eigen::Matrix3Xd C_;                       ///< of the shape
  Eigen::Matrix3Xd points_mm_;               ///< of the shape, at each line
  std::vector<Eigen::Matrix3d> covariance_;  ///< of each of them, mm^2
  State state_ = State::kGiven;
  std::array<Hypothesis, kMoves> hypotheses_;
  std::size_t likeliest_ = 0;  ///< of them
  TurnSearch search_;
  int astray_ = 0;                                ///< images since one of them had the tube for long enough
  MonotonicTime shape_of_{};                      ///< instant of points_mm_
  static constexpr double kOtherPlace_mm = 20;    ///< by which it goes until its error is another one
  static constexpr double kWorthwhileNews = 0.1;  ///< less is waited for
  static constexpr int kGoodInARow = 8;           ///< images that have the tube where it is expected
  static constexpr int kAstray = 16;  ///< images in which none has it for so long: it is elsewhere
  static constexpr std::size_t kPlaces = 16;
  std::array<Eigen::Matrix3Xd, kPlaces> refined_at_mm_;  ///< where the tube was when its pose was refined
  std::size_t refined_ = 0;                              ///< how often that was
  ViewPose before_;                                      ///< the pose before the newest move
  ViewPose pose_;  ///< of the likeliest one, against the coils as registered
  std::uint32_t moves_ = 0;
  bool has_settled_ = false;
  MonotonicTime last_{};
  MonotonicTime seen_{};     ///< the newest image
  MonotonicTime resumed_{};  ///< the first one after a while without
  bool is_told_ = false;     ///< the background says how it moved
  bool was_unseen_ = false;  ///< no image shows the beginning of its move
  MonotonicTime moved_since_{};
  MonotonicTime bad_since_{};
  MonotonicTime last_use_{};
  double sigma_across_mm_ = 0;
};

}  // namespace tubed
