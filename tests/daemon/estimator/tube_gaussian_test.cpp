// Sums of columns and a measurement of zero, against matrices written out.
#include "daemon/estimator/tube_gaussian.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cstdlib>

namespace tubed {
namespace {

constexpr int kColumns = 30;

TubeGaussian correlated() {
  TubeGaussian tube(kColumns);
  std::srand(11);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(3 * kColumns, 3 * kColumns);
  tube.P = A * A.transpose() + Eigen::MatrixXd::Identity(3 * kColumns, 3 * kColumns);
  tube.m.setRandom();
  tube.C.setRandom();
  return tube;
}

Eigen::MatrixXd selection_of(const ColumnSum& sum) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, 3 * kColumns);
  for (std::size_t k = 0; k < sum.column.size(); ++k) {
    H.middleCols<3>(3 * sum.column[k]) += sum.weight[k] * Eigen::Matrix3d::Identity();
  }
  return H;
}

TEST(TubeGaussian, ACovarianceOfSumsIsTheOneOfTheirMatrices) {
  const TubeGaussian tube = correlated();
  const UniformCubicBSpline spline(26, 380);
  ColumnSum a(spline.basis(12));
  a.column.back() = 27;
  a.weight.back() = 1;
  const ColumnSum b(spline.basis(200));
  const Eigen::Matrix3d expected = selection_of(a) * tube.P * selection_of(b).transpose();
  EXPECT_LT((tube.covariance_of(a, b) - expected).cwiseAbs().maxCoeff(), 1e-12);
}

// Kalman, H the column: P - P H^T (H P H^T + R)^-1 H P, and both means by the same gain.
TEST(TubeGaussian, TighteningIsAMeasurementOfZero) {
  TubeGaussian tube = correlated();
  const TubeGaussian before = tube;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, 3 * kColumns);
  H.middleCols<3>(3 * 28).setIdentity();
  const Eigen::MatrixXd gain =
      before.P * H.transpose() * (H * before.P * H.transpose() + 0.7 * Eigen::Matrix3d::Identity()).inverse();

  Eigen::MatrixXd scratch = tube.P;
  tube.tighten(28, 0.7, scratch);

  EXPECT_LT((tube.P - (before.P - gain * H * before.P)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((tube.m.reshaped() - (before.m.reshaped() - gain * before.m.col(28))).cwiseAbs().maxCoeff(),
            1e-9);
  EXPECT_LT((tube.C.reshaped() - (before.C.reshaped() - gain * before.C.col(28))).cwiseAbs().maxCoeff(),
            1e-9);
}

}  // namespace
}  // namespace tubed
