// The shape of one instant from its own measurements alone: coils, then coils and image lines.
#pragma once

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/tip/mirror_test.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// What became of the images of an instant.
enum class ImageVerdict {
  kNone,         ///< there was nothing to look at
  kShowsTube,    ///< and it helped
  kContradicts,  ///< it shows the tube clearly, elsewhere than the coils say
  kLost,         ///< it shows no tube, or another one
};

/// What the images of an instant are asked for.
enum class Asked {
  kOnce,           ///< nothing else will be asked of them: what they show is believed
  kToBegin,        ///< a piece of tube so short that chance may agree with it can wait for the next images
  kSecondOpinion,  ///< so can it here; which ridge is the tube's the images alone say
  kSecondOpinionOnTail,  ///< and the far end is followed again
};

/// One an estimator; called by the optimizer thread only. Memory is taken in the constructor.
class SingleFrameSolver {
 public:
  SingleFrameSolver(const EstimatorSettings& settings, const InstrumentDescription& instrument);

  /// With fewer usable coils nobody can say that one contradicts the others.
  static constexpr int kMinForMajority = 4;

  /// Shares of the lines that agree with the tube: with fewer than the first, or with fewer than the second
  /// while the coils object (chi^2 a coil, 5 degrees of freedom), an image shows another scene. The tube's
  /// own image had at least 0.68 and a chi^2 of at most 2.2 in all frames tried, another scene's 0.56 and 4.2
  /// in the median.
  static constexpr double kMinAgreeing = 0.62;
  static constexpr double kDoubtfulAgreeing = 0.78;

  /// Bending is measured from this hook from the next solve_em() on, which begins with its binormal; nullptr:
  /// from a straight tube. It belongs to the caller.
  void set_rest(RestHook* hook) { rest_ = hook; }

  /// Weighted MAP of Eq. (14) of the coils; a coil that contradicts the others is marked kOutlier: where one
  /// lies in the hook, with the hook, else with a straight tip. False with fewer than two usable coils.
  bool solve_em(CoilObservations& coils, TubeEstimate& estimate);

  /// From the shape of solve_em(): looks for the tube in the images of the instant and solves coils and lines
  /// together, three rounds with narrowing lines. A tip that no coil holds is followed through the images
  /// before, may bend as it does there (bending()), and is tried on the other side of the depth where it
  /// turns (MirrorTest). Between images the lines of the newest one help once more. To begin, the prediction
  /// of the coils says which of two ridges side by side is the tube's (RidgeChoice); a second opinion that
  /// was led by it would be nearer to the coils for that reason alone. An image that does not show the tube
  /// (too few lines agree, or are in view where that can wait, or those that do contradict the coils) is
  /// dropped and the shape of the coils stays.
  ImageVerdict fuse_images(const Observation& observation, const CoilObservations& coils, TubeViews& views,
                           Asked asked, TubeEstimate& estimate);

  /// Prepares map().covariance() at the shape found. False when that fails.
  bool invert(const Observation& observation, const CoilObservations& coils, TubeViews& views);

  [[nodiscard]] const Eigen::Matrix3Xd& C() const { return C_; }

  /// Factors on how much the shape found may bend, see TubeMap::set_bending().
  [[nodiscard]] const Eigen::VectorXd& bending() const { return bending_; }
  /// Of the mirror test of a tip that no coil holds, 3 x coefficients; zero where there was none.
  [[nodiscard]] const Eigen::Matrix3Xd& rival() const { return mirror_test_.rival(); }
  /// Does no coil hold the tip, so that the mirror test is made of it?
  [[nodiscard]] bool has_loose_tip(const CoilObservations& coils) const;
  [[nodiscard]] bool is_ambiguous() const { return mirror_test_.is_ambiguous(); }
  [[nodiscard]] const TubeMap& map() const { return map_; }
  [[nodiscard]] bool converged() const { return converged_; }

 private:
  [[nodiscard]] int first_reach_px() const;
  void trace_tail(const Observation& observation, const CoilObservations& coils, TubeViews& views,
                  TubeEstimate& estimate);
  void trace_tip(const Observation& observation, const CoilObservations& coils, TubeViews& views,
                 TubeEstimate& estimate);
  void test_mirrored(const Observation& observation, const CoilObservations& coils, TubeViews& views,
                     TubeEstimate& estimate);
  double pull_on(const CoilObservations& coils, double coil_cost_before);
  ImageVerdict judge_images(const CoilObservations& coils, double coil_cost_before, bool may_be_chance,
                            const TubeEstimate& estimate);
  void reject_outlier(CoilObservations& coils);

  EstimatorSettings settings_;
  TubeMap map_;
  Eigen::Matrix3Xd C_;
  Eigen::Matrix3Xd C_em_;       ///< the shape before the images were asked
  Eigen::VectorXd bending_;     ///< the factors of map_
  Eigen::Matrix3Xd C_without_;  ///< scratch of the leave-one-out test
  MirrorTest mirror_test_;
  RestHook* rest_ = nullptr;
  bool converged_ = false;
};

}  // namespace tubed
