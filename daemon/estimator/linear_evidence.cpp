#include "daemon/estimator/linear_evidence.hpp"

#include <cmath>
#include <limits>

namespace tubed {

LinearEvidence::LinearEvidence(Eigen::Index unknowns, std::size_t parts)
    : for_good_{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)},
      parts_(parts, for_good_),
      frozen_(for_good_),
      cholesky_(unknowns),
      inverse_(for_good_.information),
      D_(for_good_.vector),
      scaled_(for_good_.vector),
      mean_(for_good_.vector) {}

void LinearEvidence::Sums::clear() {
  information.setZero();
  vector.setZero();
  is_empty = true;
}

void LinearEvidence::Sums::take(Sums& other) {
  if (other.is_empty) return;
  information += other.information;
  vector += other.vector;
  is_empty = false;
  other.clear();
}

void LinearEvidence::forget(double kept) {
  const auto fade = [kept](Sums& sums) {
    sums.information *= kept;
    sums.vector *= kept;
  };
  fade(for_good_);
  for (Sums& part : parts_) {
    if (!part.is_empty) fade(part);
  }
}

void LinearEvidence::add(const Eigen::VectorXd& row, double residual, double variance,
                         std::optional<std::size_t> part) {
  Sums& sums = part ? parts_[*part] : for_good_;
  scaled_ = row / variance;
  sums.information.noalias() += row * scaled_.transpose();
  sums.vector += scaled_ * residual;
  sums.is_empty = false;
}

void LinearEvidence::retract(std::size_t part) {
  if (!parts_[part].is_empty) parts_[part].clear();
}

void LinearEvidence::keep(std::size_t part, std::optional<std::size_t> in) {
  (in ? parts_[*in] : for_good_).take(parts_[part]);
}

void LinearEvidence::freeze() {
  frozen_ = for_good_;
  for (const Sums& part : parts_) {
    if (!part.is_empty) {
      frozen_.information += part.information;
      frozen_.vector += part.vector;
    }
  }
}

double LinearEvidence::explain(const Eigen::VectorXd& D) {
  D_ = D;
  DenseCholesky::Lower A = cholesky_.matrix();
  for (Eigen::Index column = 0; column < D.size(); ++column) {
    for (Eigen::Index row = column; row < D.size(); ++row) {
      A(row, column) = D[row] * frozen_.information(row, column) * D[column] + (row == column ? 1 : 0);
    }
  }
  if (!cholesky_.factorise()) {
    mean_.setZero();
    return -std::numeric_limits<double>::infinity();
  }
  const double half_log_determinant = cholesky_.matrix().diagonal().array().log().sum();
  scaled_ = D.cwiseProduct(frozen_.vector);
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
