// Frangi's vesselness of dark ridges, the second half of y (Sec. 2.2, reference [32] of the paper's field:
// Frangi 1998).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "daemon/image/frangi_settings.hpp"

namespace tubed {

/// Multi-scale Frangi filter of one image size. Called by one thread (that camera's Frangi stage); all memory
/// is taken in the constructor, filter() never allocates.
///
/// For each scale: Gaussian of sigma' = sqrt(sigma^2 - 0.2) (the 3 x 3 Hessian stencil blurs by the rest),
/// Hessian times sigma^2, eigenvalues |l1| <= |l2|; dark ridges have l2 > 0:
///   v = exp(-(l1/l2)^2 / (2 beta^2)) (1 - exp(-(l1^2 + l2^2) / (2 c^2))), 0 where l2 <= 0; the maximum over
///   scales.
class FrangiFilter {
 public:
  /// Precondition: width, height >= 8 px; every scale >= 0.5 px.
  FrangiFilter(int width, int height, const FrangiSettings& settings);

  /// `grey` and `vesselness` are width x height, row by row. Borders are replicated. vesselness in 0 .. 1.
  void filter(std::span<const float> grey, std::span<float> vesselness);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  struct Scale {
    float variance;                  ///< sigma^2, normalises the Hessian
    std::vector<float> half_kernel;  ///< weights from the centre outwards
  };

  void smooth(std::span<const float> grey, const Scale& scale);
  float second_derivatives(float variance);
  void add_response(float c, std::span<float> vesselness, bool first) const;

  int width_;
  int height_;
  float beta_;
  float structureness_;
  std::vector<Scale> scales_;
  std::vector<float> padded_row_;  ///< one row or blended column with its replicated border
  std::vector<float> rows_;        ///< horizontally smoothed image
  std::vector<float> smoothed_;
  std::vector<float> trace_;   ///< (Hxx + Hyy) / 2 of each pixel, times sigma^2
  std::vector<float> spread_;  ///< half the difference of the eigenvalues, >= 0, times sigma^2
};

}  // namespace tubed
