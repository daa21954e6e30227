// Frangi's vesselness of dark ridges, the second half of y (Sec. 2.2, reference [32] of the paper's field:
// Frangi 1998).
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "daemon/image/frangi_kernels.hpp"
#include "daemon/image/frangi_plane.hpp"
#include "daemon/image/frangi_settings.hpp"

namespace tubed {

/// Pixels of one image, row by row without padding, of whatever depth. Looks at the caller's memory.
class GreyPixels {
 public:
  GreyPixels(std::span<const float> pixels) : pixels_(pixels) {}
  GreyPixels(std::span<const std::uint8_t> pixels) : pixels_(pixels) {}
  GreyPixels(std::span<const std::uint16_t> pixels) : pixels_(pixels) {}
  template <typename Pixel>
  GreyPixels(const std::vector<Pixel>& pixels) : pixels_(std::span<const Pixel>(pixels)) {}

  using Depths =
      std::variant<std::span<const float>, std::span<const std::uint8_t>, std::span<const std::uint16_t>>;
  [[nodiscard]] const Depths& depths() const { return pixels_; }

 private:
  Depths pixels_;
};

/// Where the filter writes: images of width x height, row by row. The last three are empty or all there.
struct RidgeMaps {
  std::span<float> vesselness;  ///< 0 .. 1
  std::span<float> scale_px{};  ///< sigma of the scale that answered most; 0 where none did
  /// Cosine and sine of twice the angle of the ridge, the direction along it, from x towards y of the image;
  /// doubled, a direction and its opposite are one, so that it may be averaged. 0 where there is no ridge.
  std::span<float> double_angle_cos{};
  std::span<float> double_angle_sin{};
};

/// Direction along a ridge in (-pi/2, pi/2] from the maps' cosine and sine.
inline float ridge_angle_rad(float double_angle_cos, float double_angle_sin) {
  return 0.5F * std::atan2(double_angle_sin, double_angle_cos);
}

/// Multi-scale Frangi filter of one image size. Called by one thread (that camera's Frangi stage); all memory
/// is taken in the constructor, nothing else allocates.
///
/// For each scale: Gaussian of sigma' = sqrt(sigma^2 - 0.2) (the 3 x 3 Hessian stencil blurs by the rest),
/// Hessian times sigma^2, eigenvalues |l1| <= |l2|; dark ridges have l2 > 0 (bright ones l2 < 0):
///   v = exp(-(l1/l2)^2 / (2 beta^2)) (1 - exp(-(l1^2 + l2^2) / (2 c^2))), 0 where l2 has the other sign; the
///   maximum over scales. Beyond the border the outermost pixels are repeated.
class FrangiFilter {
 public:
  /// Least size of an image, px.
  static constexpr int kLeastSize = 16;

  /// Throws std::invalid_argument when the image is smaller than 16 x 16 px, there is no scale, or a scale is
  /// not within 0.5 .. 20 px.
  FrangiFilter(int width, int height, const FrangiSettings& settings);

  /// Filters the whole image. Precondition: `grey` and the maps have width x height pixels.
  void filter(const GreyPixels& grey, const RidgeMaps& maps);
  void filter(const GreyPixels& grey, std::span<float> vesselness) { filter(grey, RidgeMaps{vesselness}); }

  /// Filters the pixels inside the rectangles (they may overlap or reach beyond the image; those narrower
  /// than 16 px are widened); pixels elsewhere keep what they hold. With structureness 0, c is that of the
  /// last whole image; where there has been none, this image's. Pixels are the same as those of the whole
  /// image with equal c.
  void filter_tiles(const GreyPixels& grey, std::span<const PixelRectangle> tiles, const RidgeMaps& maps);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// c of scale `i`, grey levels: as configured, or found in the last whole image (0: none yet).
  [[nodiscard]] float structureness(std::size_t i) const { return scales_[i].c; }

 private:
  struct Scale {
    float sigma_px;
    int reach;
    bool integers;                     ///< smoothed in 16 bits where the image is of integers
    std::vector<float> weights;        ///< from the centre outwards
    std::vector<std::uint16_t> pairs;  ///< GaussianTaps::pairs
    float c;
  };

  [[nodiscard]] PixelRectangle whole() const { return {0, 0, width_, height_}; }
  [[nodiscard]] bool in_integers(const Scale& scale) const { return scale.integers && integer_image_; }
  [[nodiscard]] PixelRectangle usable(const PixelRectangle& tile) const;
  [[nodiscard]] ResponseScale response_of(const Scale& scale) const;

  void load(const GreyPixels& grey, const PixelRectangle& part);
  template <typename Pixel>
  void load_floats(std::span<const Pixel> grey, const PixelRectangle& part);
  template <typename Pixel>
  void load_words(std::span<const Pixel> grey, const PixelRectangle& part);
  void choose_gain(const GreyPixels& grey);

  void smooth(const Scale& scale, int y, int begin, int end, float* out);
  void stream(const Scale& scale, const PixelRectangle& block, const RidgeMaps& maps);
  void find_structureness(Scale& scale);
  void respond_everywhere(const Scale& scale, const RidgeMaps& maps);

  int width_;
  int height_;
  float polarity_;  ///< 1 dark, -1 bright
  float per_blob_;
  bool fixed_c_;
  bool any_integer_scale_;
  bool any_float_scale_;
  bool integer_image_ = false;  ///< the loaded image is of 8 or 16 bits
  int shift_ = 0;               ///< loaded integers are grey values times 2^shift
  std::vector<Scale> scales_;
  int margin_;
  PaddedPlane<float> source_;
  PaddedPlane<std::uint16_t> source_words_;  ///< of one row where 16-bit smoothing is not configured
  PaddedPlane<float> between_;               ///< one row
  PaddedPlane<std::uint16_t> between_words_;
  PaddedPlane<float> smoothed_;  ///< row y of the image at y + 1; while streaming, the last four rows
  std::vector<const float*> rows_;
  std::vector<const std::uint16_t*> word_rows_;
};

}  // namespace tubed
