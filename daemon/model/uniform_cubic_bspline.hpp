// The default form of the tube's centreline: a uniform cubic B-spline over arc length with free (unclamped)
// ends. b(s) = sum_i C_i B_i(s), Eq. (1), with the local basis of Eq. (2). n coefficients cover [0, length]
// with spacing h = length / (n - 3); coefficient i sits at s = (i - 1) h. s = 0 is the tip.
#pragma once

#include <Eigen/Core>
#include <array>

namespace tubed {

/// The four coefficients that shape the curve at one s and their weights in b, b' and b'' (per mm, per mm^2).
struct CubicBasis {
  int first = 0;  ///< index of the first of four coefficients
  std::array<double, 4> value{};
  std::array<double, 4> first_derivative{};
  std::array<double, 4> second_derivative{};
};

/// Where the coefficients of a uniform cubic B-spline sit. A value type; never allocates.
class UniformCubicBSpline {
 public:
  /// Precondition: coefficient_count >= 4, length_mm > 0.
  UniformCubicBSpline(int coefficient_count, double length_mm);

  /// Weights at arc length s; outside [0, length] the end pieces are continued as cubics.
  [[nodiscard]] CubicBasis basis(double s_mm) const;

  [[nodiscard]] int coefficient_count() const { return coefficient_count_; }
  [[nodiscard]] double length_mm() const { return length_mm_; }
  [[nodiscard]] double spacing_mm() const { return spacing_mm_; }

 private:
  int coefficient_count_;
  double length_mm_;
  double spacing_mm_;
};

/// sum of weights[k] * C.col(first + k); C is 3 x n, one coefficient a column, tip first.
template <typename Coefficients>
Eigen::Vector3d combine(const Coefficients& C, int first, const std::array<double, 4>& weights) {
  return C.col(first) * weights[0] + C.col(first + 1) * weights[1] + C.col(first + 2) * weights[2] +
         C.col(first + 3) * weights[3];
}

}  // namespace tubed
