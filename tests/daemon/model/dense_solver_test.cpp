#include "daemon/model/dense_solver.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

constexpr double kRounding = 1e-12;

/// Entries between -1 and 1, always the same.
Eigen::MatrixXd some_matrix(Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    matrix(i % rows, i / rows) = std::sin(static_cast<double>(i * i) + 0.3);
  }
  return matrix;
}

Eigen::MatrixXd some_positive_matrix(Eigen::Index n) {
  const Eigen::MatrixXd root = some_matrix(n, n);
  return root * root.transpose() + Eigen::MatrixXd::Identity(n, n);
}

TEST(DenseSolver, TheInverseTimesTheMatrixIsTheIdentity) {
  const Eigen::MatrixXd A = some_matrix(7, 7) + 3 * Eigen::MatrixXd::Identity(7, 7);

  EXPECT_LT((inverse_of(A) * A - Eigen::MatrixXd::Identity(7, 7)).norm(), kRounding);
}

TEST(DenseSolver, EveryFactorisationSolvesWhatItWasGiven) {
  const Eigen::MatrixXd A = some_positive_matrix(9);
  const Eigen::MatrixXd B = some_matrix(9, 4);
  const Eigen::VectorXd b = B.col(1);

  EXPECT_LT((A * solve_llt(A, B) - B).norm(), kRounding * A.norm());
  EXPECT_LT((A * solve_llt(A, b) - b).norm(), kRounding * A.norm());
  EXPECT_LT((A * solve_ldlt(A, b) - b).norm(), kRounding * A.norm());
}

TEST(DenseSolver, TheUpperFactorIsTriangularAndItsSquareTheMatrix) {
  const Eigen::MatrixXd A = some_positive_matrix(6);

  const Eigen::MatrixXd U = upper_factor(A);

  EXPECT_TRUE(U.isUpperTriangular(0));
  EXPECT_LT((U.transpose() * U - A).norm(), kRounding * A.norm());
}

TEST(DenseSolver, TheResidualOfLeastSquaresIsNormalToTheColumns) {
  const Eigen::MatrixXd A = some_matrix(12, 5);
  const Eigen::MatrixXd B = some_matrix(12, 3);

  const LeastSquares fit(A);

  EXPECT_EQ(fit.rank(), 5);
  EXPECT_LT((A.transpose() * (A * fit.solve(B) - B)).norm(), kRounding);
}

TEST(DenseSolver, ColumnsThatDependOnEachOtherLowerTheRank) {
  Eigen::MatrixXd A = some_matrix(12, 5);
  A.col(3) = A.col(0) - 2 * A.col(1);

  EXPECT_EQ(LeastSquares(A).rank(), 4);
}

}  // namespace
}  // namespace tubed
