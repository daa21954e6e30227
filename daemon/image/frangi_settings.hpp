#pragma once

#include <vector>

namespace tubed {

/// Scales and sensitivities of the Frangi filter.
struct FrangiSettings {
  std::vector<double> scales_px{1.0, 1.5, 2.0, 3.0};  ///< sigma of each Gaussian, px
  double beta = 0.5;           ///< how much blob-like structure is suppressed, unit-less
  double structureness = 0.0;  ///< Frangi's c, grey levels; 0 = half the greatest Hessian norm of the image
};

}  // namespace tubed
