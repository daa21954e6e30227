// Gauss-Newton's normal equations for spline coefficients: J^T J dC = -J^T r, gathered residual by residual.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>

namespace tubed {

/// The unknowns are n columns of 3 components (column k at rows 3k .. 3k+2): the coefficients, and behind
/// them whatever else is estimated, as the errors of coils. A residual touches four neighbouring coefficients
/// (a point, tangent or second derivative of the cubic B-spline at one s) and at most one further column. All
/// memory is taken in the constructor.
class NormalEquations {
 public:
  explicit NormalEquations(int column_count);

  void clear();

  /// A scalar whitened residual r with dr/dC_k = weights[k] * gradient for the four coefficients from
  /// `first`.
  void add(int first, const std::array<double, 4>& weights, const Eigen::Vector3d& gradient, double residual);

  /// Three whitened residuals at once: r with dr/dC_k = weights[k] * scale * I.
  void add_isotropic(int first, const std::array<double, 4>& weights, double scale,
                     const Eigen::Vector3d& residual);

  /// Three whitened residuals at once: r with dr/dC_k = weights[k] * gradient for the four coefficients and
  /// dr/dC_further = further_scale * I for the column `further`, which must not be one of the four.
  void add_with(int first, const std::array<double, 4>& weights, const Eigen::Matrix3d& gradient, int further,
                double further_scale, const Eigen::Vector3d& residual);

  /// A Gaussian prior: information matrix (3n x 3n, symmetric) around a mean from which C has gone by
  /// `departure`.
  void add_prior(const Eigen::MatrixXd& information, const Eigen::VectorXd& departure);

  /// Factorises and solves; `step` is 3 x n. False when the matrix is not positive definite.
  bool solve(double damping, Eigen::Matrix3Xd& step);

  /// Inverts what was gathered (no damping) so that covariance() may be asked. False when not positive
  /// definite.
  bool invert();

  /// Covariance of sum_k weights[k] C_{first + k}, mm^2. Precondition: invert() was true.
  [[nodiscard]] Eigen::Matrix3d covariance(int first, const std::array<double, 4>& weights) const;

  /// All of the inverse, 3n x 3n, column k at rows 3k .. 3k + 2. Precondition: invert() was true.
  [[nodiscard]] const Eigen::MatrixXd& inverse() const { return inverse_; }

  /// Sum of the squares of all residuals added since clear().
  [[nodiscard]] double cost() const { return cost_; }

 private:
  int column_count_;
  double cost_ = 0;
  Eigen::MatrixXd matrix_;    ///< lower triangle of J^T J
  Eigen::VectorXd gradient_;  ///< J^T r
  Eigen::MatrixXd factor_;
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd solution_;
};

}  // namespace tubed
