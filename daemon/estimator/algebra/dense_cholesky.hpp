// Symmetric positive definite matrices: factor, solutions, inverse.
#pragma once

#include <hwy/aligned_allocator.h>

#include <Eigen/Core>

#include "daemon/estimator/algebra/dense_kernels.hpp"

namespace tubed {

/// One matrix at a time, of a size fixed in the constructor, which takes all memory. By Cholesky's factor L;
/// the inverse is L^-T L^-1, where the zeros of the triangles are skipped. Of 114 x 114, Eigen's LLT compiled
/// for any x86-64 takes 51 us of CPU to factorise and solve and 357 us for the inverse; this takes 19 and
/// 31 us, choosing the vector instructions at run time (medians of 5, `./run bench factorisations
/// --benchmark_repetitions=5`).
class DenseCholesky {
 public:
  using Lower = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

  explicit DenseCholesky(Eigen::Index size);

  /// Where the matrix is written, size x size, before factorise(); only its lower triangle is read.
  [[nodiscard]] Lower matrix();

  /// Replaces the matrix by its factor. False, and nothing of it is left, when it is not positive definite.
  bool factorise();

  /// x for matrix * x = b, in place of b. Precondition: factorise() was true.
  void solve(Eigen::VectorXd& b) const;

  /// The inverse, both triangles, size x size; the factor stays. False when it is not finite. Precondition:
  /// factorise() was true.
  bool invert(Eigen::MatrixXd& inverse);

 private:
  [[nodiscard]] DenseSquare square(double* first) const;

  Eigen::Index size_;
  std::size_t padded_size_;
  std::size_t stride_;
  hwy::AlignedFreeUniquePtr<double[]> factor_;
  hwy::AlignedFreeUniquePtr<double[]> upper_;    ///< L^-T
  hwy::AlignedFreeUniquePtr<double[]> product_;  ///< L^-T L^-1
};

}  // namespace tubed
