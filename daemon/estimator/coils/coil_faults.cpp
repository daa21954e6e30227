#include "daemon/estimator/coils/coil_faults.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace tubed {

CoilFaults::CoilFaults(const CoilFaultModel& model, int max_coils)
    : model_(model), cholesky_(Eigen::MatrixXd::Zero(3 * max_coils, 3 * max_coils)) {}

void CoilFaults::weigh(const CoilInnovations& innovations, CoilBeliefs& beliefs) noexcept {
  const auto belief_of = [&](int k) -> double& {
    return beliefs[static_cast<std::size_t>(innovations.coil[static_cast<std::size_t>(k)])];
  };
  for (int k = 0; k < innovations.count; ++k) {
    const double belief = bounded_belief(belief_of(k));
    log_right_[static_cast<std::size_t>(k)] = std::log(belief);
    log_wrong_[static_cast<std::size_t>(k)] = std::log1p(-belief);
  }
  max_log_ = -std::numeric_limits<double>::infinity();
  sum_ = 0;
  sum_right_.fill(0);
  visit(innovations, 0, {});
  if (!(sum_ > 0)) {
    return;
  }
  for (int k = 0; k < innovations.count; ++k) {
    belief_of(k) = bounded_belief(sum_right_[static_cast<std::size_t>(k)] / sum_);
  }
}

// Depth first, so that subsets share the factor of the coils that they have in common.
void CoilFaults::visit(const CoilInnovations& all, int k, const Subset& subset) noexcept {
  if (k == all.count) {
    add(subset, k);
    return;
  }
  const auto index = static_cast<std::size_t>(k);
  const bool was_wrong = log_wrong_[index] > log_right_[index];
  const Rest rest = eliminate(all, k);
  for (const bool is_wrong : {false, true}) {
    Subset next = subset;
    next.changes += is_wrong != was_wrong ? 1 : 0;
    const bool are_all_wrong = is_wrong && subset.wrong_count == k;
    if (all.count > kMaxExhaustiveCoils && next.changes > kMaxChanges && !are_all_wrong) {
      continue;
    }
    next.wrong |= is_wrong ? 1U << index : 0U;
    next.wrong_count += is_wrong ? 1 : 0;
    next.log_weight += (is_wrong ? log_wrong_[index] : log_right_[index]) + log_likelihood(rest, k, is_wrong);
    visit(all, k + 1, next);
  }
}

// The next three rows of the factor, left of the diagonal; the same whether coil k is wrong or not.
CoilFaults::Rest CoilFaults::eliminate(const CoilInnovations& all, int k) noexcept {
  const Eigen::Index row = 3 * k;
  Rest rest{all.innovation_mm.segment<3>(row), all.covariance_mm2.block<3, 3>(row, row)};
  for (int j = 0; j < k; ++j) {
    const Eigen::Index column = 3 * j;
    Eigen::Matrix3d block = all.covariance_mm2.block<3, 3>(row, column);
    for (int i = 0; i < j; ++i) {
      block -=
          cholesky_.block<3, 3>(row, 3 * i).lazyProduct(cholesky_.block<3, 3>(column, 3 * i).transpose());
    }
    const Eigen::Matrix3d solved =
        block.lazyProduct(inverse_diagonal_[static_cast<std::size_t>(j)].transpose());
    cholesky_.block<3, 3>(row, column) = solved;
    rest.covariance_mm2 -= solved.lazyProduct(solved.transpose());
    rest.innovation_mm -= solved.lazyProduct(whitened_[static_cast<std::size_t>(j)]);
  }
  return rest;
}

// Of coil k given those before it.
double CoilFaults::log_likelihood(const Rest& rest, int k, bool is_wrong) noexcept {
  Eigen::Matrix3d own = rest.covariance_mm2;
  own.diagonal().array() += is_wrong ? model_.distance_mm * model_.distance_mm : 0;
  const Eigen::LLT<Eigen::Matrix3d> llt(own);
  const Eigen::Matrix3d factor = llt.matrixL();
  const double determinant = factor.diagonal().prod();
  if (llt.info() != Eigen::Success || !(determinant > 0)) {
    sum_ = std::numeric_limits<double>::quiet_NaN();  // no subset says anything then
    return -std::numeric_limits<double>::infinity();
  }
  const auto index = static_cast<std::size_t>(k);
  inverse_diagonal_[index] = factor.inverse();
  whitened_[index] = inverse_diagonal_[index].lazyProduct(rest.innovation_mm);
  return -0.5 * whitened_[index].squaredNorm() - std::log(determinant);
}

void CoilFaults::add(const Subset& subset, int count) noexcept {
  if (!std::isfinite(subset.log_weight)) {
    return;
  }
  if (subset.log_weight > max_log_) {
    const double scale = std::exp(max_log_ - subset.log_weight);
    sum_ *= scale;
    for (double& sum : sum_right_) sum *= scale;
    max_log_ = subset.log_weight;
  }
  const double weight = std::exp(subset.log_weight - max_log_);
  sum_ += weight;
  for (int k = 0; k < count; ++k) {
    if ((subset.wrong >> k & 1U) == 0) sum_right_[static_cast<std::size_t>(k)] += weight;
  }
}

}  // namespace tubed
