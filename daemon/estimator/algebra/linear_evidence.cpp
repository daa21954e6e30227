#include "daemon/estimator/algebra/linear_evidence.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();

}  // namespace

LinearEvidence::LinearEvidence(Eigen::Index unknowns, std::size_t parts)
    : for_good_{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)},
      parts_(parts, for_good_),
      frozen_(for_good_),
      cholesky_(unknowns),
      D_(for_good_.vector),
      scaled_(for_good_.vector),
      mean_(for_good_.vector),
      base_{0, D_, mean_, for_good_.information} {}

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
    return log_evidence_ = kNever;
  }
  const double half_log_determinant = cholesky_.matrix().diagonal().array().log().sum();
  scaled_ = D.cwiseProduct(frozen_.vector);
  mean_ = scaled_;
  cholesky_.solve(mean_);
  const double square = scaled_.dot(mean_);
  mean_ = mean_.cwiseProduct(D);
  return log_evidence_ = square / 2 - half_log_determinant;
}

bool LinearEvidence::take_as_base() {
  if (log_evidence_ == kNever || !cholesky_.invert(base_.covariance)) {
    return false;
  }
  base_.log_evidence = log_evidence_;
  base_.D = D_;
  base_.mean = mean_;
  for (Eigen::Index column = 0; column < D_.size(); ++column) {
    base_.covariance.col(column).array() *= D_.array() * D_[column];
  }
  return true;
}

double LinearEvidence::widened(std::span<const Widened> unknowns) {
  const auto count = static_cast<Eigen::Index>(std::min(unknowns.size(), kMaxWidened));
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxWidened, 1> S(count);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxWidened, 1> m(count);
  double log_evidence = base_.log_evidence;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto [unknown, sigma] = unknowns[static_cast<std::size_t>(i)];
    const double base_sigma = base_.D[unknown];
    const double ratio = std::max(sigma / base_sigma, 1.0);
    S[i] = std::sqrt(1 - 1 / squared(ratio)) / base_sigma;
    m[i] = base_.mean[unknown];
    J_[static_cast<std::size_t>(i)] = unknown;
    log_evidence -= std::log(ratio);
  }
  const auto V = [this](Eigen::Index i, Eigen::Index k) {
    return base_.covariance(J_[static_cast<std::size_t>(i)], J_[static_cast<std::size_t>(k)]);
  };
  Small C = Small::Identity(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index k = 0; k < count; ++k) {
      C(i, k) -= S[i] * V(i, k) * S[k];
    }
  }
  const Eigen::LLT<Small> factor(C);
  if (factor.info() != Eigen::Success) {
    mean_.setZero();
    return kNever;
  }
  gained_ = factor.solve(Small(S.asDiagonal()));
  gained_ = S.asDiagonal() * gained_;
  log_evidence += m.dot(gained_ * m) / 2 - factor.matrixLLT().diagonal().array().log().sum();
  mean_ = base_.mean;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxWidened, 1> way = gained_ * m;
  for (Eigen::Index i = 0; i < count; ++i) {
    mean_ += way[i] * base_.covariance.col(J_[static_cast<std::size_t>(i)]);
  }
  return log_evidence;
}

Eigen::Matrix<double, 6, 6> LinearEvidence::covariance_of_first() const {
  const auto column = [this](Eigen::Index i) {
    return base_.covariance.col(J_[static_cast<std::size_t>(i)]).head<6>();
  };
  Eigen::Matrix<double, 6, 6> gained = Eigen::Matrix<double, 6, 6>::Zero();
  for (Eigen::Index i = 0; i < gained_.rows(); ++i) {
    for (Eigen::Index k = 0; k < gained_.cols(); ++k) {
      gained += gained_(i, k) * column(i) * column(k).transpose();
    }
  }
  return base_.covariance.topLeftCorner<6, 6>() + gained;
}

double LinearEvidence::variance_of(Eigen::Index unknown) const {
  const auto to = [this, unknown](Eigen::Index i) {
    return base_.covariance(unknown, J_[static_cast<std::size_t>(i)]);
  };
  double variance = base_.covariance(unknown, unknown);
  for (Eigen::Index i = 0; i < gained_.rows(); ++i) {
    for (Eigen::Index k = 0; k < gained_.cols(); ++k) {
      variance += gained_(i, k) * to(i) * to(k);
    }
  }
  return variance;
}

}  // namespace tubed
