#include "daemon/estimator/algebra/dense_cholesky.hpp"

#include <algorithm>

namespace tubed {

namespace {

std::size_t rounded_up(std::size_t value, std::size_t multiple) {
  return (value + multiple - 1) / multiple * multiple;
}

hwy::AlignedFreeUniquePtr<double[]> zeros(std::size_t count) {
  auto memory = hwy::AllocateAligned<double>(count);
  if (memory == nullptr) throw std::bad_alloc();
  std::fill_n(memory.get(), count, 0.0);
  return memory;
}

}  // namespace

// An odd multiple of 64 bytes: columns a power of two apart would push each other out of the cache.
DenseCholesky::DenseCholesky(Eigen::Index size)
    : size_(size),
      padded_size_(rounded_up(static_cast<std::size_t>(size), kDenseColumns)),
      stride_(rounded_up(padded_size_, kDenseRows) + 8),
      factor_(zeros(padded_size_ * stride_)),
      upper_(zeros(padded_size_ * stride_)),
      product_(zeros(padded_size_ * stride_)) {}

DenseSquare DenseCholesky::square(double* first) const { return {first, padded_size_, stride_}; }

DenseCholesky::Lower DenseCholesky::matrix() {
  return {factor_.get(), size_, size_, Eigen::OuterStride<>(static_cast<Eigen::Index>(stride_))};
}

bool DenseCholesky::factorise() {
  // Rows beyond the matrix may hold what an earlier one left there.
  const auto size = static_cast<std::size_t>(size_);
  for (std::size_t j = 0; j < padded_size_; ++j) {
    std::fill(factor_.get() + j * stride_ + size, factor_.get() + (j + 1) * stride_, 0.0);
  }
  for (std::size_t j = size; j < padded_size_; ++j) {
    factor_[j * stride_ + j] = 1;
  }
  return factorise_lower(square(factor_.get()));
}

void DenseCholesky::solve(Eigen::VectorXd& b) const {
  const double* L = factor_.get();
  const Eigen::Index n = size_;
  const auto stride = static_cast<Eigen::Index>(stride_);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double* column = L + j * stride;
    b[j] /= column[j];
    const Eigen::Index below = n - j - 1;
    b.tail(below) -= b[j] * Eigen::Map<const Eigen::VectorXd>(column + j + 1, below);
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    const double* column = L + j * stride;
    const Eigen::Index below = n - j - 1;
    b[j] = (b[j] - b.tail(below).dot(Eigen::Map<const Eigen::VectorXd>(column + j + 1, below))) / column[j];
  }
}

bool DenseCholesky::invert(Eigen::MatrixXd& inverse) {
  invert_factor(square(factor_.get()), square(upper_.get()));
  square_of_upper(square(upper_.get()), square(product_.get()));
  const Lower lower(product_.get(), size_, size_, Eigen::OuterStride<>(static_cast<Eigen::Index>(stride_)));
  inverse = lower.selfadjointView<Eigen::Lower>();
  return inverse.allFinite();
}

}  // namespace tubed
