// An error that many residuals share, eliminated.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace tubed {

/// Residuals r_i(C) + h_i . u share an unknown u of six parts, u ~ N(0, I) a priori. Of least squares over C
/// and u, u is eliminated (the Schur complement): with
///   M = I + sum h_i h_i^T,   g = sum h_i r_i,   B = sum J_i^T h_i^T
/// the sum of squares loses g^T M^-1 g, its J^T r loses B M^-1 g and its J^T J loses B M^-1 B^T. With
/// M = L L^T that is y^T y, E y and E E^T, where y = L^-1 g and E = B L^-T. Never allocates.
class SharedError {
 public:
  static constexpr int kParts = 6;
  using Parts = Eigen::Matrix<double, kParts, 1>;

  void clear() {
    M_.setIdentity();
    g_.setZero();
  }
  /// A residual and its derivative by u.
  void add(const Parts& h, double residual) {
    M_.noalias() += h * h.transpose();
    g_ += residual * h;
  }
  /// After the last one: finds L and y.
  void close() {
    L_.compute(M_);
    y_ = L_.matrixL().solve(g_);
  }
  [[nodiscard]] const Parts& y() const { return y_; }
  /// E from B: one row, L E_row^T = B_row^T.
  [[nodiscard]] Parts scaled(const Parts& row_of_B) const { return L_.matrixL().solve(row_of_B); }

 private:
  Eigen::Matrix<double, kParts, kParts> M_ = Eigen::Matrix<double, kParts, kParts>::Zero();
  Parts g_ = Parts::Zero();
  // Of the unit matrix, so that one in which nothing was ever solved can be moved.
  Eigen::LLT<Eigen::Matrix<double, kParts, kParts>> L_{Eigen::Matrix<double, kParts, kParts>::Identity()};
  Parts y_ = Parts::Zero();
};

}  // namespace tubed
