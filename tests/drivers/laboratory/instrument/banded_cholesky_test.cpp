#include "drivers/laboratory/instrument/banded_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

namespace tubed {
namespace {

TEST(BandedCholesky, SolvesAsEigensDenseFactorisationDoes) {
  constexpr int kBand = 3;
  constexpr Eigen::Index kSize = 20;
  srand(4);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(kSize, kSize);
  BandedCholesky<kBand> banded;
  banded.reset(kSize);
  for (Eigen::Index column = 0; column < kSize; ++column) {
    for (Eigen::Index row = column; row < std::min(kSize, column + kBand + 1); ++row) {
      const double value = row == column ? 5 : Eigen::internal::random<double>(-1, 1);
      dense(row, column) = dense(column, row) = value;
      banded.add(row, column, value);
    }
  }
  const Eigen::VectorXd g = Eigen::VectorXd::LinSpaced(kSize, -1, 2);

  Eigen::VectorXd x = g;
  ASSERT_TRUE(banded.factorise());
  banded.solve(x);

  EXPECT_LT((x - dense.llt().solve(g)).norm(), 1e-12);
}

TEST(BandedCholesky, AnIndefiniteMatrixIsSaidToBeOne) {
  BandedCholesky<1> banded;
  banded.reset(2);
  banded.add(0, 0, 1);
  banded.add(1, 1, 1);
  banded.add(1, 0, 2);
  EXPECT_FALSE(banded.factorise());
}

}  // namespace
}  // namespace tubed
