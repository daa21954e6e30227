#include "daemon/estimator/linear_evidence.hpp"

#include <cmath>
#include <limits>

namespace tubed {

LinearEvidence::LinearEvidence(Eigen::Index unknowns)
    : information_(Eigen::MatrixXd::Zero(unknowns, unknowns)),
      vector_(Eigen::VectorXd::Zero(unknowns)),
      frozen_information_(information_),
      frozen_vector_(vector_),
      cholesky_(unknowns),
      inverse_(information_),
      D_(vector_),
      scaled_(vector_),
      mean_(vector_) {}

void LinearEvidence::forget(double kept) {
  information_ *= kept;
  vector_ *= kept;
}

void LinearEvidence::add(const Eigen::VectorXd& row, double residual, double variance) {
  scaled_ = row / variance;
  information_.noalias() += row * scaled_.transpose();
  vector_ += scaled_ * residual;
}

void LinearEvidence::freeze() {
  frozen_information_ = information_;
  frozen_vector_ = vector_;
}

double LinearEvidence::explain(const Eigen::VectorXd& D) {
  D_ = D;
  DenseCholesky::Lower A = cholesky_.matrix();
  for (Eigen::Index column = 0; column < D.size(); ++column) {
    for (Eigen::Index row = column; row < D.size(); ++row) {
      A(row, column) = D[row] * frozen_information_(row, column) * D[column] + (row == column ? 1 : 0);
    }
  }
  if (!cholesky_.factorise()) {
    mean_.setZero();
    return -std::numeric_limits<double>::infinity();
  }
  const double half_log_determinant = cholesky_.matrix().diagonal().array().log().sum();
  scaled_ = D.cwiseProduct(frozen_vector_);
  mean_ = scaled_;
  cholesky_.solve(mean_);
  const double square = scaled_.dot(mean_);
  mean_ = mean_.cwiseProduct(D);
  return square / 2 - half_log_determinant;
}

bool LinearEvidence::covariance_of_first(Eigen::Matrix<double, 6, 6>& covariance) {
  if (!cholesky_.invert(inverse_)) {
    return false;
  }
  covariance = D_.head<6>().asDiagonal() * inverse_.topLeftCorner<6, 6>() * D_.head<6>().asDiagonal();
  return true;
}

}  // namespace tubed
