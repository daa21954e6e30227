#include "daemon/estimator/positive_definite.hpp"

#include <Eigen/Cholesky>

namespace tubed {

namespace {

constexpr Eigen::Index kSmall = 24;

using Block = Eigen::Block<Eigen::MatrixXd>;

Block block_of(Block& of, Eigen::Index row, Eigen::Index column, Eigen::Index rows, Eigen::Index columns) {
  return {of.nestedExpression(), of.startRow() + row, of.startCol() + column, rows, columns};
}

// Column by column, forward substitution of the identity.
void invert_small_lower(Block& L) {
  const Eigen::Index n = L.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double pivot = 1 / L(k, k);
    L(k, k) = pivot;
    for (Eigen::Index i = k + 1; i < n; ++i) {
      L(i, k) *= -pivot;
    }
    for (Eigen::Index j = k + 1; j < n; ++j) {  // L(j, j) is not inverted yet
      L(j, k) /= L(j, j);
      const double factor = L(j, k);
      for (Eigen::Index i = j + 1; i < n; ++i) {
        L(i, k) -= L(i, j) * factor;
      }
    }
  }
}

/// L becomes L^-1; above the diagonal nothing is read or written.
void invert_lower(Block L, Block scratch) {
  const Eigen::Index n = L.rows();
  if (n <= kSmall) {
    invert_small_lower(L);
    return;
  }
  const Eigen::Index half = n / 2;
  const Eigen::Index rest = n - half;
  Block upper = block_of(L, 0, 0, half, half);
  Block lower = block_of(L, half, half, rest, rest);
  Block corner = block_of(L, half, 0, rest, half);
  invert_lower(upper, scratch);
  invert_lower(lower, scratch);
  Block product = block_of(scratch, 0, 0, rest, half);
  // The inverse of [A 0; B D] has -D^-1 B A^-1 in its corner.
  product.noalias() = corner * upper.triangularView<Eigen::Lower>();
  corner.noalias() = lower.triangularView<Eigen::Lower>() * product;
  corner *= -1;
}

}  // namespace

bool invert_positive_definite(Eigen::MatrixXd& matrix, Eigen::MatrixXd& scratch) {
  const Eigen::Index n = matrix.rows();
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) {
    return false;
  }
  invert_lower(Block(matrix, 0, 0, n, n), Block(scratch, 0, 0, n, n));
  matrix.triangularView<Eigen::StrictlyUpper>().setZero();
  // L^-T L^-1 is the sum over the rows of L^-1; the upper half of them ends at the diagonal.
  const Eigen::Index half = n / 2;
  scratch.setZero();
  scratch.topLeftCorner(half, half)
      .selfadjointView<Eigen::Lower>()
      .rankUpdate(matrix.topLeftCorner(half, half).transpose());
  scratch.selfadjointView<Eigen::Lower>().rankUpdate(matrix.bottomRows(n - half).transpose());
  matrix = scratch.selfadjointView<Eigen::Lower>();
  return matrix.allFinite();
}

}  // namespace tubed
