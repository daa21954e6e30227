#include "daemon/estimator/coil_faults.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tubed {

namespace {

constexpr double kMinProbability = 1e-6;  // nothing is certain: a logarithm must stay finite

double bounded(double probability) { return std::clamp(probability, kMinProbability, 1 - kMinProbability); }

}  // namespace

CoilInnovations::CoilInnovations(int most_coils)
    : innovation_mm(Eigen::VectorXd::Zero(3 * most_coils)),
      covariance_mm2(Eigen::MatrixXd::Zero(3 * most_coils, 3 * most_coils)) {}

CoilFaults::CoilFaults(const CoilFaultModel& model, int most_coils)
    : model_(model),
      cholesky_(Eigen::MatrixXd::Zero(3 * most_coils, 3 * most_coils)),
      whitened_(Eigen::VectorXd::Zero(3 * most_coils)) {}

CoilFaults::Beliefs CoilFaults::at_first() const {
  Beliefs beliefs;
  beliefs.fill(bounded(1 - model_.probability));
  return beliefs;
}

void CoilFaults::age(double dt_s, Beliefs& beliefs) const {
  const double goes_right = -std::expm1(-std::max(dt_s, 0.0) / model_.lasting_s);
  for (double& belief : beliefs) {
    belief = bounded(belief * (1 - model_.probability) + (1 - belief) * goes_right);
  }
}

void CoilFaults::weigh(const CoilInnovations& innovations, Beliefs& beliefs) noexcept {
  innovations_ = &innovations;
  for (int k = 0; k < innovations.count; ++k) {
    const auto index = static_cast<std::size_t>(k);
    const double belief = beliefs[static_cast<std::size_t>(innovations.coil[index])];
    log_right_[index] = std::log(belief);
    log_wrong_[index] = std::log1p(-belief);
  }
  max_log_ = -std::numeric_limits<double>::infinity();
  sum_ = 0;
  sum_right_.fill(0);
  visit(0, 0, 0, 0);
  if (innovations.count == 0 || !(sum_ > 0)) {
    return;
  }
  for (int k = 0; k < innovations.count; ++k) {
    const auto index = static_cast<std::size_t>(k);
    beliefs[static_cast<std::size_t>(innovations.coil[index])] = bounded(sum_right_[index] / sum_);
  }
}

// Depth first, so that subsets share the factor of the coils that they have in common.
void CoilFaults::visit(int k, std::uint32_t wrong, int wrong_count, double log_weight) noexcept {
  const int count = innovations_->count;
  if (k == count) {
    add_subset(wrong, log_weight);
    return;
  }
  const auto index = static_cast<std::size_t>(k);
  const bool takes_all = count <= kMaxSubsetsOf;
  if (takes_all || wrong_count <= kMaxApart) {
    visit(k + 1, wrong, wrong_count, log_weight + log_right_[index] + log_likelihood(k, false));
  }
  if (takes_all || wrong_count < kMaxApart || wrong_count == k) {
    visit(k + 1, wrong | (1U << index), wrong_count + 1,
          log_weight + log_wrong_[index] + log_likelihood(k, true));
  }
}

// Of coil k given those before it, by the next three rows of the factor; -infinity where it does not exist.
double CoilFaults::log_likelihood(int k, bool is_wrong) noexcept {
  const Eigen::Index row = 3 * k;
  Eigen::Matrix3d own = innovations_->covariance_mm2.block<3, 3>(row, row);
  Eigen::Vector3d left = innovations_->innovation_mm.segment<3>(row);
  if (is_wrong) {
    own.diagonal().array() += model_.distance_mm * model_.distance_mm;
  }
  for (int j = 0; j < k; ++j) {
    const Eigen::Index column = 3 * j;
    Eigen::Matrix3d block = innovations_->covariance_mm2.block<3, 3>(row, column);
    for (int i = 0; i < j; ++i) {
      block.noalias() -= cholesky_.block<3, 3>(row, 3 * i) * cholesky_.block<3, 3>(column, 3 * i).transpose();
    }
    const Eigen::Matrix3d factor = cholesky_.block<3, 3>(column, column);
    const Eigen::Matrix3d solved =
        factor.triangularView<Eigen::Lower>().solve(block.transpose().eval()).transpose();
    cholesky_.block<3, 3>(row, column) = solved;
    own.noalias() -= solved * solved.transpose();
    left.noalias() -= solved * whitened_.segment<3>(column);
  }
  const Eigen::LLT<Eigen::Matrix3d> llt(own);
  const Eigen::Matrix3d factor = llt.matrixL();
  const double determinant = factor.diagonal().prod();
  if (llt.info() != Eigen::Success || !(determinant > 0)) {
    sum_ = std::numeric_limits<double>::quiet_NaN();  // no subset says anything then
    return -std::numeric_limits<double>::infinity();
  }
  const Eigen::Vector3d whitened = factor.triangularView<Eigen::Lower>().solve(left);
  cholesky_.block<3, 3>(row, row) = factor;
  whitened_.segment<3>(row) = whitened;
  return -0.5 * whitened.squaredNorm() - std::log(determinant);
}

void CoilFaults::add_subset(std::uint32_t wrong, double log_weight) noexcept {
  if (!std::isfinite(log_weight)) {
    return;
  }
  if (log_weight > max_log_) {
    const double scale = std::exp(max_log_ - log_weight);
    sum_ *= scale;
    for (double& sum : sum_right_) sum *= scale;
    max_log_ = log_weight;
  }
  const double weight = std::exp(log_weight - max_log_);
  sum_ += weight;
  for (int k = 0; k < innovations_->count; ++k) {
    if ((wrong & (1U << static_cast<unsigned>(k))) == 0) sum_right_[static_cast<std::size_t>(k)] += weight;
  }
}

// Twice the logarithm of the odds, and of the ratio of the two densities' heights.
double gain_to_leave_out(const CoilFaultModel& model, double belief, double sigma_mm) {
  const double right = bounded(belief);
  const double ratio = model.distance_mm / sigma_mm;
  return 2 * std::log(right / (1 - right)) + 3 * std::log1p(ratio * ratio);
}

}  // namespace tubed
