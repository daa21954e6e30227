#include "daemon/estimator/algebra/dense_kernels.hpp"

#include <algorithm>
#include <array>
#include <cmath>

// This file is compiled once for each instruction set: Highway includes it again for every one.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "daemon/estimator/algebra/dense_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tubed {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, kDenseRows / 2>;

/// The lower triangle of the four by four block on L's diagonal at column j, its diagonal inverted.
struct Corner {
  double i0, l10, i1, l20, l21, i2, l30, l31, l32, i3;
};

// Two registers of rows by four columns: out = sum over k in [begin, end) of R(rows, k) S(columns, k), or
// what out held less that sum. Eight sums at once hide how long each addition takes.
template <bool kSubtract>
HWY_INLINE void multiply(const double* HWY_RESTRICT R, const double* HWY_RESTRICT S, std::size_t stride,
                         std::size_t begin, std::size_t end, double* out) {
  const Doubles d;
  const std::size_t n = hn::Lanes(d);
  auto a0 = hn::Zero(d);
  auto a1 = a0;
  auto a2 = a0;
  auto a3 = a0;
  auto b0 = a0;
  auto b1 = a0;
  auto b2 = a0;
  auto b3 = a0;
  for (std::size_t k = begin; k < end; ++k) {
    const auto upper = hn::Load(d, R + k * stride);
    const auto lower = hn::Load(d, R + k * stride + n);
    const double* s = S + k * stride;
    const auto s0 = hn::Set(d, s[0]);
    const auto s1 = hn::Set(d, s[1]);
    const auto s2 = hn::Set(d, s[2]);
    const auto s3 = hn::Set(d, s[3]);
    a0 = hn::MulAdd(upper, s0, a0);
    b0 = hn::MulAdd(lower, s0, b0);
    a1 = hn::MulAdd(upper, s1, a1);
    b1 = hn::MulAdd(lower, s1, b1);
    a2 = hn::MulAdd(upper, s2, a2);
    b2 = hn::MulAdd(lower, s2, b2);
    a3 = hn::MulAdd(upper, s3, a3);
    b3 = hn::MulAdd(lower, s3, b3);
  }
  const auto write = [&](std::size_t column, auto above, auto below) HWY_ATTR {
    double* to = out + column * stride;
    if (kSubtract) {
      above = hn::Sub(hn::Load(d, to), above);
      below = hn::Sub(hn::Load(d, to + n), below);
    }
    hn::Store(above, d, to);
    hn::Store(below, d, to + n);
  };
  write(0, a0, b0);
  write(1, a1, b1);
  write(2, a2, b2);
  write(3, a3, b3);
}

// One register of rows of four columns: T L^T = what was there.
HWY_INLINE void divide(const Corner& corner, std::size_t stride, double* T) {
  const Doubles d;
  const auto x0 = hn::Mul(hn::Load(d, T), hn::Set(d, corner.i0));
  auto x1 = hn::NegMulAdd(x0, hn::Set(d, corner.l10), hn::Load(d, T + stride));
  x1 = hn::Mul(x1, hn::Set(d, corner.i1));
  auto x2 = hn::NegMulAdd(x0, hn::Set(d, corner.l20), hn::Load(d, T + 2 * stride));
  x2 = hn::Mul(hn::NegMulAdd(x1, hn::Set(d, corner.l21), x2), hn::Set(d, corner.i2));
  auto x3 = hn::NegMulAdd(x0, hn::Set(d, corner.l30), hn::Load(d, T + 3 * stride));
  x3 = hn::NegMulAdd(x1, hn::Set(d, corner.l31), x3);
  x3 = hn::Mul(hn::NegMulAdd(x2, hn::Set(d, corner.l32), x3), hn::Set(d, corner.i3));
  hn::Store(x0, d, T);
  hn::Store(x1, d, T + stride);
  hn::Store(x2, d, T + 2 * stride);
  hn::Store(x3, d, T + 3 * stride);
}

/// Factorises the block at `at`, which is not changed. False when it is not positive definite.
HWY_INLINE bool factorise_corner(const double* at, std::size_t stride, Corner& corner) {
  const double* c1 = at + stride;
  const double* c2 = at + 2 * stride;
  const double* c3 = at + 3 * stride;
  if (!(at[0] > 0)) return false;
  corner.i0 = 1 / std::sqrt(at[0]);
  corner.l10 = at[1] * corner.i0;
  corner.l20 = at[2] * corner.i0;
  corner.l30 = at[3] * corner.i0;
  const double d1 = c1[1] - corner.l10 * corner.l10;
  if (!(d1 > 0)) return false;
  corner.i1 = 1 / std::sqrt(d1);
  corner.l21 = (c1[2] - corner.l20 * corner.l10) * corner.i1;
  corner.l31 = (c1[3] - corner.l30 * corner.l10) * corner.i1;
  const double d2 = c2[2] - corner.l20 * corner.l20 - corner.l21 * corner.l21;
  if (!(d2 > 0)) return false;
  corner.i2 = 1 / std::sqrt(d2);
  corner.l32 = (c2[3] - corner.l30 * corner.l20 - corner.l31 * corner.l21) * corner.i2;
  const double d3 = c3[3] - corner.l30 * corner.l30 - corner.l31 * corner.l31 - corner.l32 * corner.l32;
  if (!(d3 > 0)) return false;
  corner.i3 = 1 / std::sqrt(d3);
  return true;
}

/// Of a factor that is there already.
HWY_INLINE Corner corner_of(const double* at, std::size_t stride) {
  const double* c1 = at + stride;
  const double* c2 = at + 2 * stride;
  const double* c3 = at + 3 * stride;
  return {1 / at[0], at[1], 1 / c1[1], at[2], c1[2], 1 / c2[2], at[3], c1[3], c2[3], 1 / c3[3]};
}

// Columns by fours, from the left: each is what was there less what the columns before it explain, divided by
// its corner. Rows above the diagonal that share a register with it are computed and never read.
bool factorise(const DenseSquare& matrix) {
  const std::size_t n = hn::Lanes(Doubles());
  const std::size_t stride = matrix.stride;
  for (std::size_t j = 0; j < matrix.size; j += kDenseColumns) {
    double* columns = matrix.first + j * stride;
    const std::size_t top = j / (2 * n) * (2 * n);
    for (std::size_t i = top; i < matrix.size && j > 0; i += 2 * n) {
      multiply<true>(matrix.first + i, matrix.first + j, stride, 0, j, columns + i);
    }
    Corner corner{};
    if (!factorise_corner(columns + j, stride, corner)) {
      return false;
    }
    for (std::size_t i = j / n * n; i < matrix.size; i += n) {
      divide(corner, stride, columns + i);
    }
  }
  return true;
}

// U L^T = I, columns by fours from the left.
void invert(const DenseSquare& L, const DenseSquare& U) {
  const std::size_t n = hn::Lanes(Doubles());
  const std::size_t stride = L.stride;
  for (std::size_t j = 0; j < L.size; j += kDenseColumns) {
    double* columns = U.first + j * stride;
    const std::size_t bottom = (j + kDenseColumns + 2 * n - 1) / (2 * n) * (2 * n);
    for (std::size_t c = 0; c < kDenseColumns; ++c) {
      std::fill_n(columns + c * stride, bottom, 0.0);
      columns[c * stride + j + c] = 1;
    }
    for (std::size_t i = 0; i < j; i += 2 * n) {
      multiply<true>(U.first + i, L.first + j, stride, i, j, columns + i);
    }
    const Corner corner = corner_of(L.first + j * stride + j, stride);
    for (std::size_t i = 0; i < bottom; i += n) {
      divide(corner, stride, columns + i);
    }
  }
}

void square(const DenseSquare& U, const DenseSquare& product) {
  const std::size_t n = hn::Lanes(Doubles());
  for (std::size_t j = 0; j < U.size; j += kDenseColumns) {
    for (std::size_t i = j / (2 * n) * (2 * n); i < U.size; i += 2 * n) {
      multiply<false>(U.first + i, U.first + j, U.stride, std::max(i, j), U.size,
                      product.first + j * U.stride + i);
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace tubed
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tubed {

namespace {
HWY_EXPORT(factorise);
HWY_EXPORT(invert);
HWY_EXPORT(square);
}  // namespace

bool factorise_lower(const DenseSquare& matrix) { return HWY_DYNAMIC_DISPATCH(factorise)(matrix); }
void invert_factor(const DenseSquare& L, const DenseSquare& U) { HWY_DYNAMIC_DISPATCH(invert)(L, U); }
void square_of_upper(const DenseSquare& U, const DenseSquare& product) {
  HWY_DYNAMIC_DISPATCH(square)(U, product);
}

}  // namespace tubed
#endif
