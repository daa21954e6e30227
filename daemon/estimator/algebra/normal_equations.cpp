#include "daemon/estimator/algebra/normal_equations.hpp"

#include "idl/geometry/precondition.hpp"

namespace tubed {

NormalEquations::NormalEquations(int coefficient_count, int further_columns)
    : coefficient_count_(coefficient_count),
      column_count_(coefficient_count + further_columns),
      band_(LowerBand::Zero(kBandRows, 3 * coefficient_count)),
      further_(Eigen::MatrixXd::Zero(3 * further_columns, 3 * column_count_)),
      gradient_(Eigen::VectorXd::Zero(3 * column_count_)),
      shared_(Eigen::MatrixXd::Zero(3 * coefficient_count, kMaxShared * SharedError::kParts)),
      banded_(3 * coefficient_count),
      dense_(3 * column_count_),
      inverse_(Eigen::MatrixXd::Zero(3 * column_count_, 3 * column_count_)),
      solution_(gradient_) {
  clear();
}

void NormalEquations::clear() {
  band_.setZero();
  further_.setZero();
  gradient_.setZero();
  block_.begin(CoefficientBlock::kNone);
  prior_ = nullptr;
  shared_columns_ = 0;
  cost_ = 0;
}

void NormalEquations::close() {
  if (block_.first() == CoefficientBlock::kNone) {
    return;
  }
  block_.sum_up();
  Eigen::Index pair = 0;
  for (int b = 0; b < 4; ++b) {
    for (int a = b; a < 4; ++a, ++pair) {
      const auto s = block_.squares().col(pair);
      const int below = 3 * (a - b);
      double* const band = band_.col(3 * (block_.first() + b)).data() + below;
      // Column c of the block begins c rows further up in the band; on the diagonal its upper part is left
      // out.
      band[0] += s[0];
      band[1] += s[1];
      band[2] += s[2];
      if (a > b) band[kBandRows - 1] += s[1];
      band[kBandRows] += s[3];
      band[kBandRows + 1] += s[4];
      if (a > b) {
        band[2 * kBandRows - 2] += s[2];
        band[2 * kBandRows - 1] += s[4];
      }
      band[2 * kBandRows] += s[5];
    }
  }
  gradient_.segment<12>(3 * block_.first()) += block_.pull().reshaped();
  block_.begin(CoefficientBlock::kNone);
}

void NormalEquations::add_isotropic(int first, const std::array<double, 4>& weights, double scale,
                                    const Eigen::Vector3d& residual) {
  open(first);
  block_.add_isotropic(weights, scale, residual);
  cost_ += residual.squaredNorm();
}

void NormalEquations::add_with(int first, const std::array<double, 4>& weights,
                               const Eigen::Matrix3d& gradient, int further, double further_scale,
                               const Eigen::Vector3d& residual) {
  // Rows of J: [w_k G | scale_f I]. Their products: the band w_a w_b G^T G, the mixed blocks scale_f w_a G,
  // and scale_f^2 I.
  for (int axis = 0; axis < 3; ++axis) {
    add(first, weights, gradient.row(axis).transpose(), residual[axis]);
  }
  const int row = 3 * (further - coefficient_count_);
  for (int a = 0; a < 4; ++a) {
    further_.block<3, 3>(row, 3 * (first + a)) +=
        further_scale * weights[static_cast<std::size_t>(a)] * gradient;
  }
  gradient_.segment<3>(3 * further) += further_scale * residual;
  further_.block<3, 3>(row, 3 * further).diagonal().array() += further_scale * further_scale;
}

void NormalEquations::add_prior(const Eigen::MatrixXd& information, const Eigen::VectorXd& departure) {
  prior_ = &information;
  // The prior's cost d^T L d, with d = C - mean and L its information, has the gradient L d (half of the
  // derivative, as J^T r).
  solution_.noalias() = information * departure;
  gradient_ += solution_;
  cost_ += departure.dot(solution_);
}

void NormalEquations::begin_shared() {
  require(shared_columns_ < shared_.cols(), "normal equations: more shared errors than there is room for");
  shared_error_.clear();
  shared_.middleCols<SharedError::kParts>(shared_columns_).setZero();
}

void NormalEquations::add_shared(int first, const std::array<double, 4>& weights,
                                 const Eigen::Vector3d& gradient, double residual,
                                 const SharedError::Parts& shared) {
  shared_error_.add(shared, residual);
  // B += J^T h^T, where J has w_a g at the four coefficients.
  const Eigen::Matrix<double, 3, SharedError::kParts> product = gradient * shared.transpose();
  for (int a = 0; a < 4; ++a) {
    shared_.block<3, SharedError::kParts>(3 * (first + a), shared_columns_) +=
        weights[static_cast<std::size_t>(a)] * product;
  }
}

void NormalEquations::add_block(int first, const FourColumns& J, const Eigen::Vector3d& residual) {
  const Eigen::Matrix<double, 12, 12> square = J.transpose() * J;
  for (int column = 0; column < 12; ++column) {
    band_.col(3 * first + column).head(12 - column) += square.col(column).tail(12 - column);
  }
  gradient_.segment<12>(3 * first).noalias() += J.transpose() * residual;
  cost_ += residual.squaredNorm();
}

void NormalEquations::add_shared_block(int first, const FourColumns& J, const Eigen::Vector3d& residual,
                                       const Eigen::Matrix<double, 3, SharedError::kParts>& H) {
  add_block(first, J, residual);
  for (int part = 0; part < 3; ++part) {
    shared_error_.add(H.row(part).transpose(), residual[part]);
  }
  shared_.block<12, SharedError::kParts>(3 * first, shared_columns_).noalias() += J.transpose() * H;
}

void NormalEquations::end_shared() {
  shared_error_.close();
  for (Eigen::Index row = 0; row < shared_.rows(); ++row) {
    auto E = shared_.row(row).segment<SharedError::kParts>(shared_columns_);
    E = shared_error_.scaled(E.transpose()).transpose();
    gradient_[row] -= E.dot(shared_error_.y());
  }
  cost_ -= shared_error_.y().squaredNorm();
  shared_columns_ += SharedError::kParts;
}

// J^T J loses E E^T.
void NormalEquations::take_shared_away(Eigen::Index column,
                                       Eigen::Ref<Eigen::VectorXd> below_diagonal) const {
  const Eigen::Index rows = shared_.rows() - column;
  for (Eigen::Index k = 0; k < shared_columns_; ++k) {
    below_diagonal.head(rows) -= shared_(column, k) * shared_.col(k).tail(rows);
  }
}

void NormalEquations::fill_dense(double damping) {
  const Eigen::Index banded = 3 * coefficient_count_;
  const Eigen::Index all = 3 * column_count_;
  auto matrix = dense_.matrix();
  for (Eigen::Index j = 0; j < all; ++j) {
    auto column = matrix.col(j).tail(all - j);
    if (prior_ != nullptr) {
      column = prior_->col(j).tail(all - j);
    } else {
      column.setZero();
    }
    if (j < banded) {
      const Eigen::Index rows = std::min<Eigen::Index>(kBandRows, banded - j);
      column.head(rows) += band_.col(j).head(rows);
      take_shared_away(j, column);
    }
    const Eigen::Index further = std::min(all - banded, all - j);
    column.tail(further) += further_.col(j).tail(further);
    // Marquardt's damping: the diagonal times 1 + lambda.
    matrix(j, j) *= 1 + damping;
  }
}

bool NormalEquations::solve(double damping, Eigen::Matrix3Xd& step) {
  close();
  solution_ = -gradient_;
  if (is_banded()) {
    if (!banded_.factorise(band_, damping)) return false;
    banded_.solve(solution_);
  } else {
    fill_dense(damping);
    if (!dense_.factorise()) return false;
    dense_.solve(solution_);
  }
  step = solution_.reshaped(3, column_count_);
  return solution_.allFinite();
}

bool NormalEquations::invert() {
  close();
  fill_dense(0);
  return dense_.factorise() && dense_.invert(inverse_);
}

bool NormalEquations::invert_and_solve(Eigen::Matrix3Xd& step) {
  if (!invert()) {
    return false;
  }
  solution_ = -gradient_;
  dense_.solve(solution_);
  step = solution_.reshaped(3, column_count_);
  return solution_.allFinite();
}

Eigen::Matrix3d NormalEquations::covariance(int first, const std::array<double, 4>& weights) const {
  // Of x = sum_k w_k C_k: cov(x) = sum_ab w_a w_b cov(C_a, C_b), blocks of (J^T J)^-1.
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
