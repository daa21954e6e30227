// The weighted MAP of Eq. (14) over the coefficients of one tube, with image lines as further residuals.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "daemon/estimator/algebra/normal_equations.hpp"
#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/estimator/images/prepared_lines.hpp"
#include "daemon/estimator/tip/rest_hook.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"
#include "drivers/interface/stiffness_profile.hpp"

namespace tubed {

/// What is known of the coefficients before the measurements.
struct GaussianPrior {
  Eigen::MatrixXd information;  ///< 3n x 3n, coefficient k at rows 3k .. 3k + 2
  Eigen::Matrix3Xd mean;        ///< 3 x n
};

/// Which column of a 3 x n matrix is what: the spline's coefficients, then the position error (mm, world) of
/// each coil that has one, then the error of each one's unit tangent (world), then what else is estimated
/// beside them.
struct TubeColumns {
  int coefficients = 0;
  int coils_with_error = 0;  ///< that stays from one measurement to the next
  int further = 0;           ///< for whatever the caller estimates by the prior

  [[nodiscard]] int count() const { return coefficients + 2 * coils_with_error + further; }
  [[nodiscard]] int position_error(int coil) const { return coefficients + coil; }
  [[nodiscard]] int tangent_error(int coil) const { return coefficients + coils_with_error + coil; }
  [[nodiscard]] int first_further() const { return count() - further; }
};

/// Solves one instrument's MAP. Called by the optimizer thread only; memory is taken in the constructor,
/// nothing else allocates. Residuals (whitened, units in EstimatorSettings), sums of squares as in Eq.
/// (12)-(14):
/// - position: (zeta(s_i) - p_i) / sigma_p
/// - tangent: (-zeta'(s_i) / |zeta'(s_i)| - t_i) / sigma_t; t_i points toward the tip, s away from it
/// - strain: (|zeta'(s)| - 1) sqrt(ds) / sigma_strain, pointwise instead of the printed pairwise lengths L_ik
/// - bending: zeta''(s) sqrt(ds / q), Eq. (13); of a hook (zeta'' - kappa0 b x zeta') sqrt(ds / q), with
///   two soft rows that keep it in one plane and as open as it was made (RestHook). The binormal b is
///   eliminated, as the error of a pose is
/// - image: n . (pi(zeta(s)) - target) / sqrt(variance); where the pose of an image is not exact, its lines
///   share an error of it, six unknowns that are eliminated (SharedError)
///
/// The printed equation gives every term the weight 1 although their units differ; with it the tube buckles
/// between coils, so the weights here are the noise of the measurements.
class TubeMap {
 public:
  /// The errors of `coils_with_error` coils are estimated beside the shape (TubeColumns); 0: every error is
  /// noise.
  TubeMap(const EstimatorSettings& settings, double length_mm, int coils_with_error = 0,
          int further_columns = 0);

  /// Multiplies sigma_strain of the settings from here on.
  void set_strain_slack(double factor) { sigma_.strain_factor = factor; }

  /// The catheter is made so stiff, from here on; until then as stiff everywhere. The integrand of Eq. (13)
  /// is the energy of bending, E I |zeta''|^2 / 2: bending_q_per_mm of the settings is divided by the
  /// stiffness at each node. Sets the factors of set_bending() to one.
  void set_stiffness(const StiffnessProfile& stiffness);

  /// Multiplies bending_q_per_mm of the settings, beside the stiffness, from here on, at each node of the
  /// integral of Eq. (13): ones until then, bending_node_count() of them, from the tip on.
  void set_bending(const Eigen::VectorXd& factors) {
    bending_.factors = factors.cwiseProduct(bending_.softness);
  }

  /// Bending is measured from this hook from here on, which belongs to the caller and whose binormal follows
  /// the shape; nullptr: from a straight tube. At a beginning its binormal is where refine() starts.
  void set_rest(RestHook* hook) { hook_ = hook; }

  /// Evenly spaced in the mean, two to a segment of the spline.
  [[nodiscard]] Eigen::Index bending_node_count() const { return static_cast<Eigen::Index>(nodes_.size()); }

  /// The factors that a tube would have which bends at each node as much as this one is expected to, by C and
  /// its covariance: where nothing is measured, about those it was inverted with. Precondition: invert_at()
  /// was true.
  void expect_bending(const Eigen::Matrix3Xd& C, Eigen::VectorXd& factors) const;

  /// Standard deviations of what is noise of a coil from here on, an axis; those of the settings until then.
  void set_coil_noise(double sigma_position_mm, double sigma_tangent) {
    sigma_.position_mm = sigma_position_mm;
    sigma_.tangent = sigma_tangent;
  }

  /// Of every C.
  [[nodiscard]] const TubeColumns& columns() const { return columns_; }

  /// Start without any guess: the linear problem (unit speed along each coil's tangent, bending, no strain;
  /// of a hook the binormal stays as it is).
  /// False with fewer than two usable coils or an indefinite matrix.
  bool solve_linear(const CoilObservations& coils, Eigen::Matrix3Xd& C);

  /// Gauss-Newton with Levenberg's damping from C, which is replaced by the best found. Returns the
  /// iterations made; `converged` is false when the last step was still longer than 0.05 mm at any
  /// coefficient.
  int refine(const CoilObservations& coils, std::span<const ViewConstraints> views,
             const GaussianPrior* prior, int max_iterations, Eigen::Matrix3Xd& C, bool& converged);

  /// chi^2 of the shape that refine() found last, of everything: bending and strain as well.
  [[nodiscard]] double cost() const { return cost_; }

  /// Sum of squared whitened residuals of coils and strain at C: what contradicts itself. Bending is left
  /// out: a coil that makes the tube bend around a vessel's arch is no suspect.
  double contradiction(const CoilObservations& coils, const Eigen::Matrix3Xd& C) const;

  /// Linearises at C and inverts, for covariance(). False when that fails.
  bool invert_at(const CoilObservations& coils, std::span<const ViewConstraints> views,
                 const GaussianPrior* prior, const Eigen::Matrix3Xd& C);

  /// The measurements alone, without the tube's stiffness, linearised at C and joined with the prior: their
  /// mean goes to `mean`, coefficient_covariance() holds their covariance. False when that fails. What is
  /// known about every tube must not be carried from one instant to the next: as a linear constraint of the
  /// past it would hold directions that have turned since.
  bool condense(const CoilObservations& coils, std::span<const ViewConstraints> views,
                const GaussianPrior& prior, const Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& mean);

  /// Position covariance at arc length s, mm^2, world frame. Precondition: invert_at() was true.
  [[nodiscard]] Eigen::Matrix3d covariance(double s_mm) const;

  /// Of all coefficients, mm^2. Precondition: invert_at() was true.
  [[nodiscard]] const Eigen::MatrixXd& coefficient_covariance() const { return equations_.inverse(); }

  [[nodiscard]] const UniformCubicBSpline& spline() const { return spline_; }

 private:
  /// By which residuals are divided.
  struct Sigma {
    double position_mm;
    double tangent;
    double strain_factor = 1;  ///< of the settings'
  };
  /// At each of nodes_, by which bending_q_per_mm of the settings is multiplied.
  struct Bending {
    Eigen::VectorXd softness;   ///< one divided by the stiffness
    Eigen::VectorXd factors;    ///< that, and what is learnt
    Eigen::VectorXd by_itself;  ///< what expect_bending() divides by: more at the ends
  };
  /// What linearise() and cost_at() ask, beside lines_.
  struct Measurements {
    const CoilObservations& coils;
    const GaussianPrior* prior;
  };

  void linearise(const Measurements& measurements, const Eigen::Matrix3Xd& C);
  double cost_at(const Measurements& measurements, const Eigen::Matrix3Xd& C);

  template <typename Sum>
  void add_measurements(const Measurements& measurements, const Eigen::Matrix3Xd& C, Sum& sum);
  template <typename Sum>
  void add_coils(const CoilObservations& coils, const Eigen::Matrix3Xd& C, Sum& sum) const;
  template <typename Sum>
  void add_coil(const CoilObservation& coil, int index, const Eigen::Matrix3Xd& C, Sum& sum) const;
  template <typename Sum>
  void add_bending(const Eigen::Matrix3Xd& C, RestHook::Binormal binormal, Sum& sum);
  template <typename Sum>
  void add_strain(const Eigen::Matrix3Xd& C, Sum& sum) const;

  EstimatorSettings settings_;
  UniformCubicBSpline spline_;
  TubeColumns columns_;
  std::vector<CubicBasis> nodes_;  ///< of the integrals over arc length
  std::vector<double> node_places_mm_;
  Bending bending_;
  PreparedLines lines_;
  NormalEquations equations_;
  Eigen::Matrix3Xd step_;
  Eigen::Matrix3Xd trial_;
  Eigen::VectorXd departure_;
  Sigma sigma_;
  double cost_ = 0;  ///< of what refine() found last
  RestHook* hook_ = nullptr;
};

}  // namespace tubed
