#include "daemon/model/dense_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace tubed {

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A) { return A.inverse(); }

Eigen::MatrixXd solve_llt(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) { return A.llt().solve(B); }

Eigen::VectorXd solve_llt(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) { return A.llt().solve(b); }

Eigen::MatrixXd upper_factor(const Eigen::MatrixXd& A) { return A.llt().matrixU(); }

Eigen::VectorXd solve_ldlt(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) { return A.ldlt().solve(b); }

struct LeastSquares::Factors {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
};

LeastSquares::LeastSquares(const Eigen::MatrixXd& A)
    : factors_(std::make_unique<Factors>(Factors{Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(A)})) {}

LeastSquares::~LeastSquares() = default;
LeastSquares::LeastSquares(LeastSquares&&) noexcept = default;
LeastSquares& LeastSquares::operator=(LeastSquares&&) noexcept = default;

Eigen::Index LeastSquares::rank() const { return factors_->qr.rank(); }

Eigen::MatrixXd LeastSquares::solve(const Eigen::MatrixXd& B) const { return factors_->qr.solve(B); }

}  // namespace tubed
