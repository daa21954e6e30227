#include "daemon/estimator/positive_definite.hpp"

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

TEST(PositiveDefinite, TimesItsInverseIsTheIdentityForSizesOnBothSidesOfABlock) {
  for (const Eigen::Index size : {1, 3, 23, 24, 25, 48, 49, 78, 111, 150}) {
    const Eigen::MatrixXd matrix = positive_definite(size, static_cast<unsigned>(size));
    Eigen::MatrixXd inverse = matrix;
    Eigen::MatrixXd scratch = matrix;
    ASSERT_TRUE(invert_positive_definite(inverse, scratch)) << size;
    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
    EXPECT_LT((matrix * inverse - identity).cwiseAbs().maxCoeff(), 1e-7) << size;
    EXPECT_LT((inverse - inverse.transpose()).cwiseAbs().maxCoeff(), 1e-300) << size;
  }
}

TEST(PositiveDefinite, OnlyTheLowerTriangleIsRead) {
  const Eigen::MatrixXd matrix = positive_definite(60, 5);
  Eigen::MatrixXd inverse = matrix;
  inverse.triangularView<Eigen::StrictlyUpper>().setConstant(1e30);
  Eigen::MatrixXd scratch = matrix;
  ASSERT_TRUE(invert_positive_definite(inverse, scratch));
  EXPECT_LT((inverse - matrix.inverse()).cwiseAbs().maxCoeff(), 1e-6 * inverse.cwiseAbs().maxCoeff());
}

TEST(PositiveDefinite, AnIndefiniteMatrixIsRefused) {
  Eigen::MatrixXd matrix = positive_definite(30, 1);
  matrix(17, 17) = -1;
  Eigen::MatrixXd scratch = matrix;
  EXPECT_FALSE(invert_positive_definite(matrix, scratch));
}

}  // namespace
}  // namespace tubed
