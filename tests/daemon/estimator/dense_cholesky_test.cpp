#include "daemon/estimator/algebra/dense_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace tubed {
namespace {

/// A^T A of a random A, and 1e-3 of the identity.
Eigen::MatrixXd positive_definite(Eigen::Index size, unsigned seed) {
  std::srand(seed);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(size, size);
  return A.transpose() * A + 1e-3 * Eigen::MatrixXd::Identity(size, size);
}

DenseCholesky factor_of(const Eigen::MatrixXd& matrix) {
  DenseCholesky cholesky(matrix.rows());
  cholesky.matrix() = matrix;
  EXPECT_TRUE(cholesky.factorise());
  return cholesky;
}

TEST(DenseCholesky, TimesItsInverseIsTheIdentityForSizesOnBothSidesOfABlock) {
  for (const Eigen::Index size : {1, 2, 3, 4, 5, 15, 16, 17, 31, 48, 78, 111, 150, 177}) {
    const Eigen::MatrixXd matrix = positive_definite(size, static_cast<unsigned>(size));
    Eigen::MatrixXd inverse;
    ASSERT_TRUE(factor_of(matrix).invert(inverse)) << size;
    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
    EXPECT_LT((matrix * inverse - identity).cwiseAbs().maxCoeff(), 1e-7) << size;
    EXPECT_LT((inverse - inverse.transpose()).cwiseAbs().maxCoeff(), 1e-300) << size;
  }
}

TEST(DenseCholesky, SolvesWhatItWasGiven) {
  for (const Eigen::Index size : {1, 7, 64, 144}) {
    const Eigen::MatrixXd matrix = positive_definite(size, static_cast<unsigned>(size));
    const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(size, -1, 2);
    Eigen::VectorXd b = matrix * x;
    factor_of(matrix).solve(b);
    EXPECT_LT((b - x).cwiseAbs().maxCoeff(), 1e-7) << size;
  }
}

TEST(DenseCholesky, OnlyTheLowerTriangleIsRead) {
  Eigen::MatrixXd matrix = positive_definite(60, 5);
  const Eigen::MatrixXd expected = matrix.inverse();
  matrix.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
  Eigen::MatrixXd inverse;
  ASSERT_TRUE(factor_of(matrix).invert(inverse));
  EXPECT_LT((inverse - expected).cwiseAbs().maxCoeff(), 1e-6 * inverse.cwiseAbs().maxCoeff());
}

TEST(DenseCholesky, AnIndefiniteMatrixIsRefusedAndTheNextOneIsNot) {
  DenseCholesky cholesky(30);
  for (const Eigen::Index bad : {0, 1, 2, 3, 17, 29}) {
    cholesky.matrix() = positive_definite(30, 1);
    cholesky.matrix()(bad, bad) = -1;
    EXPECT_FALSE(cholesky.factorise()) << bad;
    cholesky.matrix() = positive_definite(30, 1);
    EXPECT_TRUE(cholesky.factorise()) << bad;
  }
}

}  // namespace
}  // namespace tubed
