// Symmetric positive definite matrices of cubic splines: nothing farther from the diagonal than four
// coefficients reach.
#pragma once

#include <Eigen/Core>

namespace tubed {

/// Rows of a column of the lower band: the diagonal and what stands below it. Four coefficients of three
/// components.
inline constexpr int kBandRows = 12;

/// The lower band of a matrix, a column of it a column: element (j + m, j) at (m, j). Elements that would lie
/// below the matrix are 0.
using LowerBand = Eigen::Matrix<double, kBandRows, Eigen::Dynamic>;

/// One matrix at a time, of a size fixed in the constructor, which takes all memory.
class SplineBandCholesky {
 public:
  explicit SplineBandCholesky(Eigen::Index size);

  /// Factorises `band` (size columns) with its diagonal times 1 + damping. False when that is not positive
  /// definite.
  bool factorise(const LowerBand& band, double damping);

  /// x for matrix * x = b, in place of b. Precondition: factorise() was true.
  void solve(Eigen::VectorXd& b);

 private:
  Eigen::Index size_;
  LowerBand factor_;  ///< L, its diagonal inverted, and columns for what reaches beyond the end
  Eigen::VectorXd padded_solution_;
};

}  // namespace tubed
