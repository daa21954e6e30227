#include "daemon/estimator/normal_equations.hpp"

#include "daemon/estimator/positive_definite.hpp"

namespace tubed {

NormalEquations::NormalEquations(int column_count)
    : column_count_(column_count),
      matrix_(Eigen::MatrixXd::Zero(3 * column_count, 3 * column_count)),
      gradient_(Eigen::VectorXd::Zero(3 * column_count)),
      factor_(matrix_),
      inverse_(matrix_),
      solution_(gradient_) {}

void NormalEquations::clear() {
  matrix_.setZero();
  gradient_.setZero();
  cost_ = 0;
}

void NormalEquations::add(int first, const std::array<double, 4>& weights, const Eigen::Vector3d& gradient,
                          double residual) {
  const Eigen::Matrix3d outer = gradient * gradient.transpose();
  for (int a = 0; a < 4; ++a) {
    const double weight = weights[static_cast<std::size_t>(a)];
    gradient_.segment<3>(3 * (first + a)) += weight * residual * gradient;
    for (int b = 0; b <= a; ++b) {
      matrix_.block<3, 3>(3 * (first + a), 3 * (first + b)) +=
          weight * weights[static_cast<std::size_t>(b)] * outer;
    }
  }
  cost_ += residual * residual;
}

void NormalEquations::add_isotropic(int first, const std::array<double, 4>& weights, double scale,
                                    const Eigen::Vector3d& residual) {
  for (int a = 0; a < 4; ++a) {
    const double weight = weights[static_cast<std::size_t>(a)] * scale;
    gradient_.segment<3>(3 * (first + a)) += weight * residual;
    for (int b = 0; b <= a; ++b) {
      const double product = weight * weights[static_cast<std::size_t>(b)] * scale;
      for (int axis = 0; axis < 3; ++axis) {
        matrix_(3 * (first + a) + axis, 3 * (first + b) + axis) += product;
      }
    }
  }
  cost_ += residual.squaredNorm();
}

void NormalEquations::add_with(int first, const std::array<double, 4>& weights,
                               const Eigen::Matrix3d& gradient, int further, double further_scale,
                               const Eigen::Vector3d& residual) {
  const Eigen::Matrix3d squared = gradient.transpose() * gradient;
  const Eigen::Vector3d pull = gradient.transpose() * residual;
  for (int a = 0; a < 4; ++a) {
    const double weight = weights[static_cast<std::size_t>(a)];
    gradient_.segment<3>(3 * (first + a)) += weight * pull;
    for (int b = 0; b <= a; ++b) {
      matrix_.block<3, 3>(3 * (first + a), 3 * (first + b)) +=
          weight * weights[static_cast<std::size_t>(b)] * squared;
    }
    // Only the lower triangle is kept, and a further column stands behind the coefficients.
    matrix_.block<3, 3>(3 * further, 3 * (first + a)) += further_scale * weight * gradient;
  }
  gradient_.segment<3>(3 * further) += further_scale * residual;
  matrix_.block<3, 3>(3 * further, 3 * further).diagonal().array() += further_scale * further_scale;
  cost_ += residual.squaredNorm();
}

void NormalEquations::add_prior(const Eigen::MatrixXd& information, const Eigen::VectorXd& departure) {
  matrix_ += information;
  solution_.noalias() = information * departure;
  gradient_ += solution_;
  cost_ += departure.dot(solution_);
}

bool NormalEquations::solve(double damping, Eigen::Matrix3Xd& step) {
  factor_ = matrix_;
  factor_.diagonal().array() *= 1 + damping;
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(factor_);
  if (cholesky.info() != Eigen::Success) {
    return false;
  }
  solution_ = -gradient_;
  cholesky.solveInPlace(solution_);
  for (int k = 0; k < column_count_; ++k) {
    step.col(k) = solution_.segment<3>(3 * k);
  }
  return solution_.allFinite();
}

bool NormalEquations::invert() {
  inverse_ = matrix_;
  return invert_positive_definite(inverse_, factor_);
}

Eigen::Matrix3d NormalEquations::covariance(int first, const std::array<double, 4>& weights) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      sum += weights[static_cast<std::size_t>(a)] * weights[static_cast<std::size_t>(b)] *
             inverse_.block<3, 3>(3 * (first + a), 3 * (first + b));
    }
  }
  return sum;
}

}  // namespace tubed
