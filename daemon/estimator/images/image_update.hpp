// The images of one instant taken into the state of the recursive estimator.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "daemon/estimator/images/coefficient_update.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/single_frame_solver.hpp"
#include "daemon/estimator/tip/mirror_test.hpp"
#include "daemon/estimator/tube_state.hpp"

namespace tubed {

/// One an estimator, called by the optimizer's thread only; memory is taken in the constructor.
class ImageUpdate {
 public:
  /// How far to either side of the prediction an image is searched first.
  static constexpr int kFirstReach_px = 10;
  /// Images in a row, for a short piece that was not seen before.
  static constexpr int kConfirming = 3;

  /// `column_count` of the state.
  ImageUpdate(const EstimatorSettings& settings, const InstrumentDescription& instrument,
              const RoomDescription& room, int column_count);

  /// Bending is measured from this hook: TubeMap::set_rest(); nullptr: from a straight tube.
  void set_rest(RestHook* hook);
  [[nodiscard]] const RestHook* rest() const { return rest_; }

  /// What images said.
  [[nodiscard]] TubeViews& views() { return views_; }
  [[nodiscard]] const TubeViews& views() const { return views_; }

  /// The shape that the measurements and the tube's stiffness make together, from C on, into C; the state
  /// stays as it is. False when it is numerically lost.
  bool settle(const TubeState& state, Eigen::Matrix3Xd& C, TubeEstimate& estimate);

  struct Outcome {
    ImageVerdict verdict = ImageVerdict::kNone;
    std::span<const ViewConstraints> lines;  ///< that were taken in; valid until the views are asked again
    /// A stretch of the tube, whose tip coils hold, lies further beside its prediction than it can be wrong:
    /// nothing was taken in.
    bool is_jerk = false;
    Surprise surprise{};            ///< then
    bool numerically_lost = false;  ///< the covariance is not positive definite: begin again
    double interval_s = 0;          ///< since an image showed the tube before
    double pulled = 0;              ///< chi^2 of how far they pulled the mean, and what was expected of it
    double expected = 0;
  };
  /// Looks for the tube around the prediction, twice with narrowing lines, and takes what was found into the
  /// state's Gaussian and its record of images. An image in which too few lines agree, or whose lines pull
  /// the prediction further than it can be wrong, shows something else: the prediction stays. A jerk is told
  /// with kAsked only.
  enum class Jerk { kAsked, kAllowedFor };
  Outcome apply(const Observation& observation, const CoilObservations& coils, Jerk jerk, TubeState& state,
                TubeEstimate& estimate);

  /// The covariance of the shape that settle() or apply() has found; nullptr when it cannot be had.
  const TubeMap* with_covariance(std::span<const ViewConstraints> lines) {
    return coefficients_.with_covariance(lines);
  }
  [[nodiscard]] const TubeMap& map() const { return coefficients_.map(); }

 private:
  void leave_out(MonotonicTime instant, TubeState& state, TubeEstimate& estimate);
  Outcome take(const Observation& observation, std::span<const ViewConstraints> lines, TubeState& state);
  [[nodiscard]] bool tip_is_out_of_reach(const TubeGaussian& tube) const;
  void trace_tip(const Observation& observation, double loose_mm, TubeState& state, TubeEstimate& estimate);
  void test_mirrored(std::span<const ViewConstraints> lines, const CoilObservations& coils,
                     TubeEstimate& estimate);
  bool shows_tube(MonotonicTime instant, const TubeEstimate& estimate, TubeState& state);

  int max_iterations_;
  TubeViews views_;
  CoefficientUpdate coefficients_;
  MirrorTest mirror_test_;
  Eigen::Matrix3Xd predicted_;  ///< the shape before the images of this instant
  RestHook* rest_ = nullptr;    ///< nullptr: the tip is straight while nothing bends it
};

}  // namespace tubed
