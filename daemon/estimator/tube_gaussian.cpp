#include "daemon/estimator/tube_gaussian.hpp"

#include <Eigen/LU>

namespace tubed {

ColumnSum::ColumnSum(const CubicBasis& basis) {
  for (std::size_t k = 0; k < basis.value.size(); ++k) {
    column[k] = basis.first + static_cast<Eigen::Index>(k);
    weight[k] = basis.value[k];
  }
}

TubeGaussian::TubeGaussian(int column_count)
    : C(Eigen::Matrix3Xd::Zero(3, column_count)), m(C), P(Eigen::MatrixXd::Identity(C.size(), C.size())) {}

Eigen::Matrix3d TubeGaussian::covariance_of(const ColumnSum& a, const ColumnSum& b) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.column.size(); ++i) {
    for (std::size_t j = 0; j < b.column.size(); ++j) {
      sum += a.weight[i] * b.weight[j] * P.block<3, 3>(3 * a.column[i], 3 * b.column[j]);
    }
  }
  return sum;
}

// Kalman's update with H = I at the column: gain = P_(.,c) S^-1, S = P_(c,c) + variance I.
void TubeGaussian::tighten(int column, double variance, Eigen::MatrixXd& scratch) {
  const Eigen::Matrix3d S = P.block<3, 3>(3 * column, 3 * column) + variance * Eigen::Matrix3d::Identity();
  auto gain = scratch.leftCols<3>();
  auto covariance = scratch.middleCols<3>(3);
  covariance = P.middleCols<3>(3 * column);
  gain.noalias() = covariance * S.inverse();
  for (Eigen::Matrix3Xd* mean : {&C, &m}) {
    const Eigen::Vector3d error = mean->col(column);
    Eigen::Map<Eigen::VectorXd>(mean->data(), mean->size()).noalias() -= gain * error;
  }
  P.noalias() -= gain * covariance.transpose();
}

}  // namespace tubed
