// What stays of the coils' errors from one measurement to the next, as a filter carries it on.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/coils/coil_error_scale.hpp"
#include "daemon/estimator/coils/coil_noise.hpp"
#include "daemon/estimator/tube_gaussian.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// The error of each coil's position and tangent is a Gauss-Markov process over time and the way that the
/// coil has gone; what all coils share of their positions' errors (SharedCoilErrors) lasts longest. How large
/// it is in all, and how much of it is noise, is learnt meanwhile. Copied with the state; never allocates.
class LastingCoilErrors {
 public:
  explicit LastingCoilErrors(const EstimatorSettings& settings) : noise_(settings), scale_(settings) {}

  [[nodiscard]] CoilNoise& noise() { return noise_; }
  [[nodiscard]] const CoilNoise& noise() const { return noise_; }
  [[nodiscard]] CoilErrorScale& scale() { return scale_; }

  /// Standard deviations an axis of what stays, as thought of at the state's time.
  [[nodiscard]] double position_mm() const { return position_mm_; }
  [[nodiscard]] double tangent() const { return tangent_; }

  /// Of the variance of the whole error, 0 .. 1.
  [[nodiscard]] double share() const;

  /// What the coils have shown of their noise so far decides how much of their error stays.
  void begin();
  [[nodiscard]] bool began_with_known_noise() const { return began_with_known_noise_; }

  enum class Learnt {
    kNothing,     ///< still, or already before
    kAllIsNoise,  ///< as was thought at the beginning
    kPartStays,   ///< begun while all was taken for noise, and a part of it is not: begun too sure
  };
  /// What is known by now of a state that began before anything was.
  Learnt learn();

  /// The coils are where the shape C has them.
  void place(const InstrumentDescription& instrument, const UniformCubicBSpline& spline,
             const Eigen::Matrix3Xd& C);

  /// The coils have gone to where tube.C has them now, in `dt_s`. `scratch` is of the size of tube.P.
  void age(double dt_s, const InstrumentDescription& instrument, const TubeMap& map, TubeGaussian& tube,
           Eigen::MatrixXd& scratch);

  void reset();

 private:
  void age_positions(double dt_s, const std::array<Eigen::Vector3d, kMaxCoils>& before_mm, int coil_count,
                     const TubeMap& map, TubeGaussian& tube, Eigen::MatrixXd& scratch) const;
  void age_tangent(double kept, int column, TubeGaussian& tube) const;

  CoilNoise noise_;
  CoilErrorScale scale_;
  bool began_with_known_noise_ = false;
  double position_mm_ = 0;
  double tangent_ = 0;
  double min_position_mm_ = 0;  ///< since it began
  double min_tangent_ = 0;
  std::array<Eigen::Vector3d, kMaxCoils> places_mm_{};  ///< on the tube, when errors last aged; world
};

}  // namespace tubed
