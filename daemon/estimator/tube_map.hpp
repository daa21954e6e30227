// The weighted MAP of Eq. (14) over the coefficients of one tube, with image lines as further residuals.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <span>

#include "daemon/estimator/coil_observation.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/estimator/normal_equations.hpp"
#include "daemon/geometry/camera.hpp"
#include "daemon/image/correspondence_lines.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// An image line as a residual: the projected point at s has to lie on the line through `target_px` normal to
/// `normal`, within `variance_px2`.
struct LineConstraint {
  double s_mm = 0;
  Eigen::Vector2d target_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double variance_px2 = 1;
};

/// Line constraints of one camera; a view into memory of the caller.
struct ViewConstraints {
  const Camera* camera = nullptr;
  const LineConstraint* lines = nullptr;
  int count = 0;
};

/// What is known of the coefficients before the measurements.
struct GaussianPrior {
  Eigen::MatrixXd information;  ///< 3n x 3n, coefficient k at rows 3k .. 3k + 2
  Eigen::Matrix3Xd mean;        ///< 3 x n
};

/// Solves one instrument's MAP. Called by the optimizer thread only; memory is taken in the constructor,
/// nothing else allocates. Residuals (whitened, units in EstimatorSettings), sums of squares as in Eq.
/// (12)-(14):
///   position   (zeta(s_i) - p_i) / sigma_p
///   tangent    (-zeta'(s_i) / |zeta'(s_i)| - t_i) / sigma_t         (t_i points toward the tip, s away from
///   it) strain     (|zeta'(s)| - 1) sqrt(ds) / sigma_strain, pointwise instead of the printed pairwise
///   lengths L_ik bending    zeta''(s) sqrt(ds / q), Eq. (13) image      n . (pi(zeta(s)) - target) /
///   sqrt(variance)
/// The printed equation gives every term the weight 1 although their units differ; with it the tube buckles
/// between coils, so the weights here are the noise of the measurements.
class TubeMap {
 public:
  TubeMap(const EstimatorSettings& settings, double length_mm);

  /// Weights of the tube's own stiffness from here on, in units of those in the settings: `strain` multiplies
  /// sigma_strain, `bending` the square of the bending residuals.
  void set_stiffness(double strain_sigma_factor, double bending_factor) {
    strain_sigma_factor_ = strain_sigma_factor;
    bending_factor_ = bending_factor;
  }

  /// Multiplies the variances of coils from here on.
  void set_em_variance_factor(double factor) { em_sigma_factor_ = std::sqrt(factor); }

  /// Start without any guess: the linear problem (unit speed along each coil's tangent, bending, no strain).
  /// False with fewer than two usable coils or an indefinite matrix.
  bool solve_linear(const CoilObservations& coils, Eigen::Matrix3Xd& C);

  /// Gauss-Newton with Levenberg's damping from C, which is replaced by the best found. Returns the
  /// iterations made; `converged` is false when the last step was still longer than 0.05 mm at any
  /// coefficient.
  int refine(const CoilObservations& coils, std::span<const ViewConstraints> views,
             const GaussianPrior* prior, int most_iterations, Eigen::Matrix3Xd& C, bool& converged);

  /// Sum of squared whitened residuals of coils and strain at C: what contradicts itself. Bending is left
  /// out: a coil that makes the tube bend around a vessel's arch is no suspect.
  double contradiction(const CoilObservations& coils, const Eigen::Matrix3Xd& C);

  /// Linearises at C and inverts, for covariance(). False when that fails.
  bool invert_at(const CoilObservations& coils, std::span<const ViewConstraints> views,
                 const GaussianPrior* prior, const Eigen::Matrix3Xd& C);

  /// Position covariance at arc length s, mm^2, world frame. Precondition: invert_at() was true.
  [[nodiscard]] Eigen::Matrix3d covariance(double s_mm) const;

  /// Of all coefficients, mm^2. Precondition: invert_at() was true.
  [[nodiscard]] const Eigen::MatrixXd& coefficient_covariance() const { return equations_.inverse(); }

  [[nodiscard]] const UniformCubicBSpline& spline() const { return spline_; }

 private:
  void linearise(const CoilObservations& coils, std::span<const ViewConstraints> views,
                 const GaussianPrior* prior, const Eigen::Matrix3Xd& C);
  void add_coils(const CoilObservations& coils, const Eigen::Matrix3Xd& C);
  void add_bending(const Eigen::Matrix3Xd& C);
  void add_strain(const Eigen::Matrix3Xd& C);
  void add_view(const ViewConstraints& view, const Eigen::Matrix3Xd& C);

  EstimatorSettings settings_;
  UniformCubicBSpline spline_;
  NormalEquations equations_;
  Eigen::Matrix3Xd step_;
  Eigen::Matrix3Xd trial_;
  Eigen::VectorXd departure_;
  double em_sigma_factor_ = 1;
  double strain_sigma_factor_ = 1;
  double bending_factor_ = 1;
};

}  // namespace tubed
