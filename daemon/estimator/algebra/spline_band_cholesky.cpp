#include "daemon/estimator/algebra/spline_band_cholesky.hpp"

#include <array>
#include <cmath>

namespace tubed {

SplineBandCholesky::SplineBandCholesky(Eigen::Index size)
    : size_(size),
      factor_(LowerBand::Zero(kBandRows, size + kBandRows)),
      padded_solution_(Eigen::VectorXd::Zero(size + kBandRows)) {}

// Column by column; each one is taken off those it reaches.
bool SplineBandCholesky::factorise(const LowerBand& band, double damping) {
  factor_.leftCols(size_) = band;
  factor_.leftCols(size_).row(0) *= 1 + damping;
  factor_.rightCols<kBandRows>().setZero();
  std::array<double, 2 * kBandRows> column{};  // the second half stays 0: no ends to be watched
  for (Eigen::Index j = 0; j < size_; ++j) {
    double* const first = factor_.col(j).data();
    if (!(first[0] > 0)) {
      return false;
    }
    // l_jj = sqrt(a_jj), l_ij = a_ij / l_jj; then a_ik -= l_ij l_kj for what stands to the right. 1 / l_jj is
    // kept in place of l_jj.
    const double inverse = 1 / std::sqrt(first[0]);
    for (int m = 0; m < kBandRows; ++m) {
      column[static_cast<std::size_t>(m)] = first[m] * inverse;
      first[m] = column[static_cast<std::size_t>(m)];
    }
    first[0] = inverse;
    for (int k = 1; k < kBandRows; ++k) {
      double* const further = first + k * kBandRows;
      const double* const below = column.data() + k;
      const double factor = *below;
      for (int m = 0; m < kBandRows; ++m) {
        further[m] -= factor * below[m];
      }
    }
  }
  return true;
}

void SplineBandCholesky::solve(Eigen::VectorXd& b) {
  double* const x = padded_solution_.data();
  padded_solution_.head(size_) = b;
  padded_solution_.tail<kBandRows>().setZero();
  for (Eigen::Index j = 0; j < size_; ++j) {
    const double* const column = factor_.col(j).data();
    // Forward: L y = b.
    x[j] *= column[0];
    for (int m = 1; m < kBandRows; ++m) {
      x[j + m] -= column[m] * x[j];
    }
  }
  padded_solution_.tail<kBandRows>().setZero();
  for (Eigen::Index j = size_ - 1; j >= 0; --j) {
    const double* const column = factor_.col(j).data();
    // Backward: L^T x = y.
    double sum = 0;
    for (int m = 1; m < kBandRows; ++m) {
      sum += column[m] * x[j + m];
    }
    x[j] = (x[j] - sum) * column[0];
  }
  b = padded_solution_.head(size_);
}

}  // namespace tubed
