// The inner loops of dense symmetric positive definite matrices, compiled for every instruction set and
// chosen when they are called. Sizes are a few hundred at most: blocks for caches are not needed.
#pragma once

#include <cstddef>

namespace tubed {

/// Column-major, columns `stride` apart, aligned to 64 bytes. `size` is a multiple of kDenseColumns, `stride`
/// at least `size` rounded up to a multiple of kDenseRows and a multiple of 8; what lies between may be read
/// and overwritten.
struct DenseSquare {
  double* first = nullptr;
  std::size_t size = 0;
  std::size_t stride = 0;
};

inline constexpr std::size_t kDenseColumns = 4;
inline constexpr std::size_t kDenseRows = 16;

/// Cholesky's factor L in place of the lower triangle; the upper one holds nothing of use afterwards. False,
/// with the matrix undefined, when it is not positive definite.
bool factorise_lower(const DenseSquare& matrix);

/// U = L^-T, upper triangular, zero below its diagonal as far as the others read it. Same size and stride.
void invert_factor(const DenseSquare& L, const DenseSquare& U);

/// The lower triangle of U U^T for an upper triangular U; above it nothing of use. Same size and stride.
void square_of_upper(const DenseSquare& U, const DenseSquare& product);

}  // namespace tubed
