// What can be set about the Frangi filter, and the keys of [frangi].
#pragma once

#include <cstddef>
#include <vector>

#include "idl/settings/bound_key.hpp"

namespace tubed {

/// Most scales a filter may have.
inline constexpr std::size_t kMaxFrangiScales = 8;

/// Which ridges count: catheters and wires absorb and are dark on a fluoroscopic image, bright on a negative.
enum class RidgePolarity { kDark, kBright };

/// What is said of them: kAuto begins with dark ones, and changes to what the estimator finds by its coils.
enum class PolaritySetting { kAuto, kDark, kBright };

/// The ridges that count in the first image.
inline RidgePolarity first_polarity(PolaritySetting setting) {
  return setting == PolaritySetting::kBright ? RidgePolarity::kBright : RidgePolarity::kDark;
}

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
  PolaritySetting polarity = PolaritySetting::kAuto;
  FrangiSmoothing smoothing = FrangiSmoothing::kFloat;
  FrangiArea area = FrangiArea::kBand;
};

/// The keys of [frangi].
inline BoundKeys<FrangiSettings> frangi_keys() {
  using S = FrangiSettings;
  return {key::numbers("scales_px", &S::scales_px, "px", {0.5, 20}, {1, kMaxFrangiScales},
                       "standard deviation of each Gaussian"),
          key::number("beta", &S::beta, "", {0.01, 10}, "how much blob-like structure is suppressed"),
          key::number("structureness", &S::structureness, "grey levels", {0, 65535},
                      "Frangi's c; 0 = half the greatest Hessian norm of the image"),
          key::word("polarity", &S::polarity,
                    {{PolaritySetting::kAuto, "auto"},
                     {PolaritySetting::kDark, "dark"},
                     {PolaritySetting::kBright, "bright"}},
                    "what a tube is on the image; auto: dark until the coils show that it is bright "
                    "(estimator modes filter and joint)"),
          key::word("smoothing", &S::smoothing,
                    {{FrangiSmoothing::kFloat, "float"}, {FrangiSmoothing::kInteger16, "integer16"}},
                    "arithmetic of the Gaussians up to 2.5 px; integer16: less time, more rounding"),
          key::word("area", &S::area, {{FrangiArea::kBand, "band"}, {FrangiArea::kFrame, "frame"}},
                    "what is filtered before the shape is sought; band: around the tubes where they are "
                    "expected, and what is missing when it is needed; frame: all of every image")};
}

}  // namespace tubed
