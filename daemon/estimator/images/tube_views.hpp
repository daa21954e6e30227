// What the images of all cameras say about one tube: lines searched around its projection, kept for the
// solver.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/line_verdicts.hpp"
#include "daemon/estimator/images/tube_marks.hpp"
#include "daemon/estimator/tube_map.hpp"
#include "daemon/image/image_likelihood.hpp"
#include "daemon/image/predicted_lines.hpp"
#include "daemon/image/projected_lines.hpp"
#include "daemon/image/seen_tube.hpp"

namespace tubed {

/// Of `views`, none of them without lines, the one that shows most of the tip; nullptr without any.
const ViewConstraints* view_of_tip(std::span<const ViewConstraints> views);

/// Are these two directions so far apart that what one view leaves open the other one shows: 10 degrees?
bool are_two_sides(const Eigen::Vector3d& sight_a_world, const Eigen::Vector3d& sight_b_world);

/// Do views from two sides have lines at the half of a loose tip that is nearer to its end?
bool show_tip_from_two_sides(std::span<const ViewConstraints> views, double loose_mm);

/// What of a tube is looked for in images, and how.
struct TubeSearch {
  int reach_px;             ///< to either side of its projection
  bool tip_is_held = true;  ///< by a coil: where its end is in the image matters less
  double from_mm = 0;       ///< arc length from the tip: nothing before it is looked for
  /// Marks as well. Not by who compares shapes by their cost, or asks how far an image pulls coils: a mark
  /// that is found on one of them and not on the other, or a wrong arc length, would decide.
  bool asks_marks = false;
  /// Which of two ridges side by side is the tube's, it decides; nullptr: the image alone does.
  const TubePrediction* prediction = nullptr;
  /// By who knows from images before where the tube is. Who begins has no better than a ridge, and the bounds
  /// of comparisons between shapes are set for ridges at their full height.
  LineSearch::Among among = LineSearch::Among::kTubes;
  double to_mm = std::numeric_limits<double>::infinity();  ///< as from_mm: nothing beyond it is looked for
};

/// One an estimator; called by the optimizer thread only. Memory is taken in the constructor.
class TubeViews {
 public:
  /// With fewer lines in view an image says nothing.
  static constexpr int kMinLines = 10;
  /// With a smaller share of them that agree it shows no tube.
  static constexpr double kMinFound = 0.5;

  TubeViews(const EstimatorSettings& settings, const InstrumentDescription& instrument,
            const RoomDescription& room);

  /// Looks for the tube with coefficients C in every image of the instant and keeps the lines. Fills
  /// has_image, image_inlier_ratio and in_view_ratio. False when there was no image.
  bool measure(const Observation& observation, const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C,
               const TubeSearch& search, TubeEstimate& estimate);

  /// The kept lines for a solver, one element a view that has any: those of an image of that
  /// instant as measured, older ones worth less by the way the tube may have gone since, none older than
  /// observation.image_timeout. `only_of_instant`: no older ones at all. Valid until the next call of
  /// anything here.
  std::span<const ViewConstraints> constraints(const Observation& observation, double variance_factor,
                                               bool only_of_instant);

  /// Each camera stands, from here on, as it stood when its image of the instant was taken. measure() does
  /// it as well.
  void look_from(const Observation& observation);

  [[nodiscard]] std::size_t count() const { return views_.size(); }
  /// As it stood when the newest image was taken that was looked at.
  [[nodiscard]] const Camera& camera(std::size_t view) const { return views_[view].camera; }

  /// Share of the lines in this view's image of that instant that agree, 0 .. 1, few as they may be; nothing
  /// without an image or with too few lines in view to say.
  [[nodiscard]] std::optional<double> agreeing(std::size_t view, MonotonicTime instant) const;

  /// Does this view's image of that instant show the tube where measure() found it last? Nothing without an
  /// image, or where a picture of something else may agree with most lines.
  [[nodiscard]] std::optional<bool> shows_tube(std::size_t view, MonotonicTime instant) const;

  /// Was so little of the tube in view of the images of that instant that a picture of something else agrees
  /// with most lines now and then?
  [[nodiscard]] bool may_agree_by_chance(MonotonicTime instant) const;

  /// Do the images of that instant show something else than a tip where it was looked for: do most lines of
  /// its last piece disagree, in every view that has enough of them?
  [[nodiscard]] bool misses_tip(MonotonicTime instant) const;

  /// The greatest one in the images of that instant, of stretches of 20 mm that the image shows.
  [[nodiscard]] Surprise surprise(MonotonicTime instant) const;
  /// Of the lines of every view.
  [[nodiscard]] const LineLayout& layout() const { return layout_; }

  /// How many lines of the last 32 mm of the tube the images of that instant were asked and did not show a
  /// tube at, in the view that showed most of them.
  [[nodiscard]] int unseen_at_tip(MonotonicTime instant) const;

  /// How far beyond the lines' reach an image is read around the tip.
  static constexpr double kBeyondTip_px = 22;

  /// Does the newest image of a camera, no older than observation.image_timeout, show the tube at s_mm from
  /// the tip?
  [[nodiscard]] bool shows(double s_mm, const Observation& observation) const;

  /// The instrument has marks, and hardly any of the last images in which they would have to lie shows their
  /// pattern.
  [[nodiscard]] bool marks_are_missing() const { return marks_.are_missing(); }

  /// From where that image of this camera was taken; nothing when none takes part.
  [[nodiscard]] std::optional<ViewUsed> used(std::size_t view, const Observation& observation) const;

  /// Exposure of the newest image that lines were kept of; zero: none.
  [[nodiscard]] MonotonicTime newest_exposure() const;

  /// The images of this instant showed the tube where measure() found it last: what they look like may be
  /// learnt.
  void trust(const Observation& observation);

  /// Drops the lines of the images of this instant: they showed something else.
  void forget_instant(MonotonicTime instant);

  /// Drops all lines, but keeps what the images taught.
  void forget_lines();

  void forget();

 private:
  /// All lines, the marks, and the end.
  using Constraints = std::array<LineConstraint, LineSearch::kMaxLines + kMaxMarks + 1>;

  /// What the lines of the tip say of it.
  struct TipLines {
    std::optional<bool> misses{};  ///< nothing: too few lines to say
    int unseen = 0;                ///< lines, see unseen_at_tip()
  };

  struct View {
    Camera camera;
    std::unique_ptr<ImageLikelihood> likelihood;
    PoseSigma pose_sigma{};                        ///< of the camera's pose
    bool own_pose = false;                         ///< that came with the newest image
    SeenTube seen{};                               ///< by the newest image
    Constraints measured{};                        ///< variance as measured, before ageing
    Constraints aged{};                            ///< what the solver is given
    std::optional<LineConstraint> end_by_greys{};  ///< of the newest image, see ViewConstraints
    int count = 0;
    int lines_asked = 0;       ///< of the newest image; 0: too few in view
    TipLines tip{};            ///< of the newest image
    Surprise surprise{};       ///< of the newest image
    MonotonicTime exposure{};  ///< of the image they come from; zero = none
    double inlier_ratio = 0;
    double in_view_ratio = 0;
  };

  [[nodiscard]] static bool takes_part(const View& view, const Observation& observation);
  void filter_around_lines(ImageOnDemand& on_demand, ImageMeasurement& image, ImageArea& area, int reach_px);
  void measure_view(const ImageMeasurement& image, View& view, int in_view, const TubeSearch& search);
  void measure_end(const ImageMeasurement& image, View& view, float ridge_height, bool tip_is_held);

  EstimatorSettings settings_;
  std::vector<View> views_;
  std::array<ViewConstraints, kMaxCameras> gathered_{};
  CorrespondenceLines lines_{};
  LineLayout layout_;
  std::vector<ImageArea> areas_;  ///< scratch, one a view
  double radius_mm_;
  TubeMarks marks_;
};

}  // namespace tubed
