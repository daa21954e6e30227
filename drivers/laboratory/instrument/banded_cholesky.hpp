// Solves H x = g for the symmetric matrices of a chain: nothing further than kBand from the diagonal.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace tubed {

/// A symmetric n x n matrix of half-bandwidth kBand as its lower bands, and its Cholesky factor in place:
/// cost n kBand^2. Eigen has no banded factorisation. The estimator's SplineBandCholesky is as fast (5 and 6
/// us of CPU for 78 unknowns, 37 and 40 us for 600, `./run bench factorisations`) and rounds in another way:
/// one for both would change every simulated run or every estimate in its last bits.
template <int kBand>
class BandedCholesky {
 public:
  /// Makes room for n unknowns and sets all to 0.
  void reset(Eigen::Index n) { bands_.setZero(kBand + 1, n); }
  [[nodiscard]] Eigen::Index size() const { return bands_.cols(); }

  /// Adds to entry (row, column), row >= column > row - kBand - 1.
  void add(Eigen::Index row, Eigen::Index column, double value) { bands_(row - column, column) += value; }
  void add_to_diagonal(double value) { bands_.row(0).array() += value; }
  [[nodiscard]] const Eigen::Matrix<double, kBand + 1, Eigen::Dynamic>& bands() const { return bands_; }

  /// Replaces the matrix by its factor; false, leaving rubbish, for one that is not positive definite.
  bool factorise() {
    const Eigen::Index n = size();
    for (Eigen::Index j = 0; j < n; ++j) {
      const double pivot = bands_(0, j);
      if (!(pivot > kMinPivot)) {
        return false;
      }
      const double diagonal = std::sqrt(pivot);
      const Eigen::Index below = std::min<Eigen::Index>(kBand, n - 1 - j);
      bands_.col(j).head(below + 1) /= diagonal;
      bands_(0, j) = diagonal;
      for (Eigen::Index i = 1; i <= below; ++i) {
        bands_.col(j + i).head(below - i + 1) -= bands_(i, j) * bands_.col(j).segment(i, below - i + 1);
      }
    }
    return true;
  }

  /// Overwrites g by the solution. Precondition: factorise() was true.
  void solve(Eigen::VectorXd& g) const {
    const Eigen::Index n = size();
    for (Eigen::Index j = 0; j < n; ++j) {
      const Eigen::Index below = std::min<Eigen::Index>(kBand, n - 1 - j);
      g[j] /= bands_(0, j);
      g.segment(j + 1, below) -= g[j] * bands_.col(j).segment(1, below);
    }
    for (Eigen::Index j = n - 1; j >= 0; --j) {
      const Eigen::Index below = std::min<Eigen::Index>(kBand, n - 1 - j);
      g[j] = (g[j] - bands_.col(j).segment(1, below).dot(g.segment(j + 1, below))) / bands_(0, j);
    }
  }

 private:
  static constexpr double kMinPivot = 1e-12;
  Eigen::Matrix<double, kBand + 1, Eigen::Dynamic> bands_;
};

}  // namespace tubed
