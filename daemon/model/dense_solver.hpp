// Eigen's factorisations of matrices whose size is known at run time only, compiled in one place: each takes
// seconds to compile wherever it is written. All allocate.
#pragma once

#include <Eigen/Core>
#include <memory>

namespace tubed {

/// A^-1 by LU with partial pivoting, n x n. Precondition: A is not singular.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A);

/// X for A X = B by Cholesky's A = L L^T. Precondition: A is symmetric and positive definite.
Eigen::MatrixXd solve_llt(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::VectorXd solve_llt(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// U = L^T of the same, upper triangular.
Eigen::MatrixXd upper_factor(const Eigen::MatrixXd& A);

/// x for A x = b by Cholesky's A = P^T L D L^T P. Precondition: A is symmetric and semidefinite.
Eigen::VectorXd solve_ldlt(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// min |A X - B| for one A, m x n with m >= n, and many B, m x k: QR with column pivoting.
class LeastSquares {
 public:
  explicit LeastSquares(const Eigen::MatrixXd& A);
  ~LeastSquares();
  LeastSquares(LeastSquares&&) noexcept;
  LeastSquares& operator=(LeastSquares&&) noexcept;

  [[nodiscard]] Eigen::Index rank() const;
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;

 private:
  struct Factors;
  std::unique_ptr<Factors> factors_;
};

}  // namespace tubed
