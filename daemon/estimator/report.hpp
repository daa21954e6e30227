// What every estimator writes into an estimate the same way: shape, residuals, ages and the word of validity.
#pragma once

#include "daemon/estimator/agreement/coil_image_agreement.hpp"
#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/coils/common_jump.hpp"
#include "daemon/estimator/coils/end_jumps.hpp"
#include "daemon/estimator/coils/loose_ends.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/single_frame_solver.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// As CentrelinePoint has it: xx xy xz yy yz zz.
std::array<float, 6> upper_triangle(const Eigen::Matrix3d& m);

/// A shape to be written. `covariance` nullptr: unknown, written as infinity.
struct FoundShape {
  const UniformCubicBSpline* spline = nullptr;
  /// 3 x at least the spline's coefficients, what stands behind them is no shape; nullptr: there never was
  /// one.
  const Eigen::Matrix3Xd* C = nullptr;
  const TubeMap* covariance = nullptr;  ///< whose covariance() may be asked
  MonotonicTime time{};                 ///< the instant the shape is of
  double variance_factor = 1;           ///< what is published is so many times `covariance`
  /// MirrorTest::rival() of the coefficients, which adds to it; nullptr: there is none.
  const Eigen::Matrix3Xd* rival = nullptr;
  /// Its doubt() adds to it, too, and its summary() is written; nullptr: nobody has looked.
  const CoilImageAgreement* agreement = nullptr;
  // What these leave open adds to it; nullptr: nobody has looked.
  const EndJumps* end_jumps = nullptr;
  const CommonJump* common_jump = nullptr;
  const LooseEnds* loose_ends = nullptr;
};

/// What the word of validity depends on.
struct Findings {
  bool uses_images = false;  ///< of the mode
  bool registered = true;
  bool converged = true;
  ImageVerdict images = ImageVerdict::kNone;  ///< of this instant, or LostTube::standing()
  bool em_image_disagree = false;             ///< CoilImageAgreement::disagree()
  bool ambiguous = false;                     ///< MirrorTest::is_ambiguous()
  LooseEnds::Lost lost_ends{};                ///< LooseEnds::lost()
};

/// That an image did not show the tube holds until one does, also for the shapes between images. What one
/// camera contradicts another one does not make good: it sees no depth, and holds any shape along its rays.
/// Where most images did not show it before fluoroscopy went off, that holds until it is on again: nobody has
/// seen the shape. Called by the optimizer's thread.
class LostTube {
 public:
  /// The verdict on the shape of this observation; `images` is what the images of its instant say together,
  /// and `views` what each of them says; nullptr: nothing by itself.
  ImageVerdict standing(const Observation& observation, ImageVerdict images,
                        const TubeViews* views = nullptr);
  void forget() { *this = LostTube{}; }

 private:
  void ask_each(const TubeViews& views, MonotonicTime instant, ImageVerdict images);
  [[nodiscard]] bool is_lost_in_one(MonotonicTime now) const;

  bool is_lost_ = false;
  MonotonicTime judged_{};  ///< the newest image with a verdict
  double lost_share_ = 0;   ///< of the images before and with it, older ones count less
  std::array<MonotonicTime, kMaxCameras>
      lost_in_{};  ///< newest image of that camera, when it did not; or zero
};

/// Clears what each estimate begins with: reasons, image figures, iterations.
void begin_report(const Observation& observation, TubeEstimate& estimate);

/// Is `frame`, the newest measurement until observation.instant, too old for that instant, or are
/// measurements missing until now (see EmTimeout)? True for nullptr.
bool is_stale(const EmFrame* frame, const Observation& observation, const EstimatorSettings& settings);

/// Fills valid_time_ns, radius, length, points, coefficients.
void write_shape(const FoundShape& shape, const InstrumentDescription& instrument, TubeEstimate& estimate);

/// Arc length of a published point from the tip.
double place_of_point_mm(std::size_t point, const TubeEstimate& estimate);

/// Begins held_by of all points that write_shape() has filled: with the coils that are used and near along
/// the tube. Nothing holds the last shape where measurements are stale.
void write_held_by_coils(const CoilObservations& coils, TubeEstimate& estimate);

/// The tip may be elsewhere: no coil holds what lies before the first one, at `coil_mm` from the tip.
void release_tip(double coil_mm, TubeEstimate& estimate);

/// Adds to it where the images that take part show the tube, and fills views with those.
void write_held_by_images(const Observation& observation, const TubeViews& views, TubeEstimate& estimate);

/// Adds what is not known of the patient's reference at `frame` (nullptr: nothing) to the covariance of all
/// points, which write_shape() or the mode itself has filled. T_world_em is the registration's.
void add_reference_error(const EmFrame* frame, const EmHistory& history, const RigidTransform& T_world_em,
                         TubeEstimate& estimate);

/// Fills coil_count and coils with state and distance from the shape.
void write_coils(const CoilObservations& coils, const FoundShape& shape, TubeEstimate& estimate);

/// Fills frame number, EM stamps, the ages at estimate.valid_time_ns, which has been written before, and the
/// reason for measurements that are simulated or replayed. `frame` nullptr: never a measurement.
/// `newest_image` zero: never one.
void write_measurements(const EmFrame* frame, MonotonicTime newest_image, TubeEstimate& estimate);

/// Adds reasons to those the estimate has already and sets the word of the contract. INVALID: there is no
/// shape of now. QUESTIONABLE: something that should have helped did not.
void judge(const Observation& observation, const CoilObservations& coils, const Findings& findings,
           TubeEstimate& estimate);

}  // namespace tubed
