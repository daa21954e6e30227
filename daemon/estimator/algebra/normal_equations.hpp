// Gauss-Newton's normal equations for spline coefficients: J^T J dC = -J^T r, gathered residual by residual.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/algebra/coefficient_block.hpp"
#include "daemon/estimator/algebra/dense_cholesky.hpp"
#include "daemon/estimator/algebra/shared_error.hpp"
#include "daemon/estimator/algebra/spline_band_cholesky.hpp"

namespace tubed {

/// The unknowns are n columns of 3 components (column k at rows 3k .. 3k+2): the coefficients, and behind
/// them whatever else is estimated, as the errors of coils. A residual touches four neighbouring coefficients
/// (a point, tangent or second derivative of the cubic B-spline at one s) and at most one further column.
/// Residuals alone make a band, which is solved as one; a prior, further columns or errors that residuals
/// share make it dense. All memory is taken in the constructor.
class NormalEquations {
 public:
  NormalEquations(int coefficient_count, int further_columns);

  void clear();

  /// A scalar whitened residual r with dr/dC_k = weights[k] * gradient for the four coefficients from
  /// `first`. Residuals of one `first` are best added one after another.
  void add(int first, const std::array<double, 4>& weights, const Eigen::Vector3d& gradient,
           double residual) {
    open(first);
    block_.add(weights, gradient, residual);
    cost_ += residual * residual;
  }

  /// Three whitened residuals at once: r with dr/dC_k = weights[k] * scale * I.
  void add_isotropic(int first, const std::array<double, 4>& weights, double scale,
                     const Eigen::Vector3d& residual);

  /// Three whitened residuals at once: r with dr/dC_k = weights[k] * gradient for the four coefficients and
  /// dr/dC_further = further_scale * I for the column `further`, which must not be one of the coefficients.
  void add_with(int first, const std::array<double, 4>& weights, const Eigen::Matrix3d& gradient, int further,
                double further_scale, const Eigen::Vector3d& residual);

  /// How a residual of three parts goes with the twelve numbers of four coefficients, one after another.
  using FourColumns = Eigen::Matrix<double, 3, 12>;

  /// Three whitened residuals at once, between begin_shared() and end_shared(): r with dr/dC = J for the four
  /// coefficients from `first`, and dr/du = H for the error that they share.
  void add_shared_block(int first, const FourColumns& J, const Eigen::Vector3d& residual,
                        const Eigen::Matrix<double, 3, SharedError::kParts>& H);

  /// The same without anything shared.
  void add_block(int first, const FourColumns& J, const Eigen::Vector3d& residual);

  /// A residual of the shared error alone.
  void add_to_shared(double residual, const SharedError::Parts& shared) {
    shared_error_.add(shared, residual);
    cost_ += residual * residual;
  }

  /// A Gaussian prior: information matrix (3n x 3n, symmetric) around a mean from which C has gone by
  /// `departure`. Once between clear()s; `information` must stay as it is until the next.
  void add_prior(const Eigen::MatrixXd& information, const Eigen::VectorXd& departure);

  /// From here to end_shared(), residuals of add() share an error (see SharedError), at most kMaxShared
  /// times between clear()s.
  void begin_shared();
  /// How the residual last given to add(), with the same `first`, `weights` and `gradient`, goes with it.
  void add_shared(int first, const std::array<double, 4>& weights, const Eigen::Vector3d& gradient,
                  double residual, const SharedError::Parts& shared);
  void end_shared();
  static constexpr int kMaxShared = 5;  ///< poses of four cameras and a hook's plane

  /// Factorises and solves; `step` is 3 x n. False when the matrix is not positive definite.
  bool solve(double damping, Eigen::Matrix3Xd& step);

  /// Inverts what was gathered (no damping) so that covariance() may be asked. False when not positive
  /// definite.
  bool invert();

  /// invert() and solve(0, step) for the price of the former.
  bool invert_and_solve(Eigen::Matrix3Xd& step);

  /// Covariance of sum_k weights[k] C_{first + k}, mm^2. Precondition: invert() was true.
  [[nodiscard]] Eigen::Matrix3d covariance(int first, const std::array<double, 4>& weights) const;

  /// All of the inverse, 3n x 3n, column k at rows 3k .. 3k + 2. Precondition: invert() was true.
  [[nodiscard]] const Eigen::MatrixXd& inverse() const { return inverse_; }

  /// Sum of the squares of all residuals added since clear().
  [[nodiscard]] double cost() const { return cost_; }

 private:
  // Residuals of one `first` are gathered in block_ and go to the band when another one begins.
  void open(int first) {
    if (first == block_.first()) return;
    close();
    block_.begin(first);
  }
  void close();
  void fill_dense(double damping);
  void take_shared_away(Eigen::Index column, Eigen::Ref<Eigen::VectorXd> below_diagonal) const;
  [[nodiscard]] bool is_banded() const {
    return prior_ == nullptr && column_count_ == coefficient_count_ && shared_columns_ == 0;
  }

  int coefficient_count_;
  int column_count_;
  double cost_ = 0;
  CoefficientBlock block_;
  LowerBand band_;                          ///< of J^T J, the coefficients among each other
  Eigen::MatrixXd further_;                 ///< its rows of the further columns, lower triangle
  Eigen::VectorXd gradient_;                ///< J^T r
  const Eigen::MatrixXd* prior_ = nullptr;  ///< its information
  SharedError shared_error_;                ///< the one that is being gathered
  Eigen::MatrixXd shared_;                  ///< B of that one, E of those before; rows of the coefficients
  Eigen::Index shared_columns_ = 0;         ///< of E
  SplineBandCholesky banded_;
  DenseCholesky dense_;
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd solution_;
};

}  // namespace tubed
