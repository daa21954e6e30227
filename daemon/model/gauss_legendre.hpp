// Five-point Gauss-Legendre quadrature: exact for polynomials up to degree 9.
#pragma once

#include <array>
#include <cstddef>

namespace tubed {

/// Integral of `integrand` (double to double) from `from` to `to`. Never allocates.
template <typename Integrand>
double integrate_gauss_legendre(double from, double to, const Integrand& integrand) {
  // Roots of the Legendre polynomial P5 and the weights 2 / ((1 - x^2) P5'(x)^2), on [-1, 1].
  constexpr std::array<double, 5> kNodes{-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                                         0.9061798459386640};
  constexpr std::array<double, 5> kWeights{0.2369268850561891, 0.4786286704993665, 128.0 / 225,
                                           0.4786286704993665, 0.2369268850561891};
  const double centre = (from + to) / 2;
  const double half_width = (to - from) / 2;
  double sum = 0;
  for (std::size_t k = 0; k < kNodes.size(); ++k) {
    sum += kWeights[k] * integrand(centre + half_width * kNodes[k]);
  }
  return half_width * sum;
}

}  // namespace tubed
