#pragma once

#include <cstddef>
#include <vector>

namespace tubed {

/// Most scales a filter may have.
inline constexpr std::size_t kMostFrangiScales = 8;

/// Which ridges count: catheters and wires absorb and are dark on a fluoroscopic image.
enum class RidgePolarity { kDark, kBright };

/// How the Gaussians are computed. kInteger16 holds for images of 8 and 16 bit and for scales up to 2.5 px:
/// less time, an error of about the last of 16 bits per pass (a tenth of a grey level of 8 bit in the Hessian
/// at 2 px). Coarser scales, whose second derivatives would drown in that, and float images are smoothed in
/// float.
enum class FrangiSmoothing { kFloat, kInteger16 };

/// Which part of an image is filtered before anybody asks for it.
enum class FrangiArea {
  kBand,   ///< around the tubes, where they are expected; the whole image when that is not known
  kFrame,  ///< always the whole image
};

/// Scales and sensitivities of the Frangi filter.
struct FrangiSettings {
  std::vector<double> scales_px{1.0, 1.5, 2.0,
                                3.0};  ///< sigma of each Gaussian, px, 0.5 .. 20; 1 to 8 of them
  double beta = 0.5;                   ///< how much blob-like structure is suppressed, unit-less
  double structureness = 0.0;  ///< Frangi's c, grey levels; 0 = half the greatest Hessian norm of the image
  RidgePolarity polarity = RidgePolarity::kDark;
  FrangiSmoothing smoothing = FrangiSmoothing::kFloat;
  FrangiArea area = FrangiArea::kBand;
};

}  // namespace tubed
