// Gauss-Newton's normal equations for spline coefficients: J^T J dC = -J^T r, gathered residual by residual.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/algebra/dense_cholesky.hpp"
#include "daemon/estimator/algebra/line_kernels.hpp"
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
    if (waiting_ == kMaxWaiting) sum_up();
    double* const outer = outer_.data() + 8 * waiting_;
    outer[0] = gradient[0] * gradient[0];
    outer[1] = gradient[0] * gradient[1];
    outer[2] = gradient[0] * gradient[2];
    outer[3] = gradient[1] * gradient[1];
    outer[4] = gradient[1] * gradient[2];
    outer[5] = gradient[2] * gradient[2];
    Eigen::Map<Products>(products_.data() + 12 * waiting_) = products_of(weights);
    ++waiting_;
    pull_.noalias() += (residual * gradient) * Eigen::Map<const Eigen::RowVector4d>(weights.data());
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
  using Products = Eigen::Matrix<double, 10, 1>;

  /// w_a w_b of the pairs a >= b, by columns of the lower triangle.
  static Products products_of(const std::array<double, 4>& w) {
    return {w[0] * w[0], w[1] * w[0], w[2] * w[0], w[3] * w[0], w[1] * w[1],
            w[2] * w[1], w[3] * w[1], w[2] * w[2], w[3] * w[2], w[3] * w[3]};
  }

  // Blocks of one `first` are gathered in registers' reach and go to the band when another one begins.
  void open(int first) {
    if (first == first_) return;
    close();
    first_ = first;
  }
  void close();
  void sum_up() {
    add_outer_products(outer_.data(), products_.data(), waiting_, squares_.data());
    waiting_ = 0;
  }
  void fill_dense(double damping);
  void take_shared_away(Eigen::Index column, Eigen::Ref<Eigen::VectorXd> below_diagonal) const;
  [[nodiscard]] bool is_banded() const {
    return prior_ == nullptr && column_count_ == coefficient_count_ && shared_columns_ == 0;
  }

  int coefficient_count_;
  int column_count_;
  double cost_ = 0;
  int first_ = -1;  ///< of the blocks that wait
  static constexpr std::size_t kMaxWaiting = 24;
  std::size_t waiting_ = 0;                          ///< residuals not yet in squares_
  std::array<double, 8 * kMaxWaiting> outer_{};      ///< upper triangle of g g^T, row by row, and two zeros
  std::array<double, 12 * kMaxWaiting> products_{};  ///< products_of() their weights
  Eigen::Matrix<double, 8, 10> squares_;             ///< their sum: a pair of coefficients a column
  Eigen::Matrix<double, 3, 4> pull_;                 ///< their part of J^T r
  LowerBand band_;                                   ///< of J^T J, the coefficients among each other
  Eigen::MatrixXd further_;                          ///< its rows of the further columns, lower triangle
  Eigen::VectorXd gradient_;                         ///< J^T r
  const Eigen::MatrixXd* prior_ = nullptr;           ///< its information
  SharedError shared_error_;                         ///< the one that is being gathered
  Eigen::MatrixXd shared_;           ///< B of that one, E of those before; rows of the coefficients
  Eigen::Index shared_columns_ = 0;  ///< of E
  SplineBandCholesky banded_;
  DenseCholesky dense_;
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd solution_;
};

}  // namespace tubed
