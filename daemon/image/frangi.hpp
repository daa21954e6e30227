// Frangi's vesselness of dark ridges, the second half of y (Sec. 2.2, reference [32] of the paper's field:
// Frangi 1998).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "daemon/image/cell_norms.hpp"
#include "daemon/image/frangi_kernels.hpp"
#include "daemon/image/frangi_plane.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "daemon/image/image_area.hpp"

namespace tubed {

/// Pixels of one image, row by row without padding, of whatever depth. Looks at the caller's memory.
class GreyPixels {
 public:
  GreyPixels(std::span<const float> pixels) : pixels_(pixels) {}
  GreyPixels(std::span<const std::uint8_t> pixels) : pixels_(pixels) {}
  GreyPixels(std::span<const std::uint16_t> pixels) : pixels_(pixels) {}
  template <typename Pixel>
  GreyPixels(const std::vector<Pixel>& pixels) : pixels_(std::span<const Pixel>(pixels)) {}

  /// Grey values of an integer image that are kept in float: smoothed as integers where that is set.
  struct WholeNumbers {
    std::span<const float> pixels;  ///< 0 .. brightest, without fractions
    float brightest = 0;            ///< up to 65535
  };
  GreyPixels(const WholeNumbers& pixels) : pixels_(pixels) {}

  using Depths = std::variant<std::span<const float>, std::span<const std::uint8_t>,
                              std::span<const std::uint16_t>, WholeNumbers>;
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

/// What a filter keeps of an image it works on.
enum class FrangiMemory {
  kWholeImage,  ///< all smoothed pixels of a scale: whole images with structureness 0 are filtered at once
  kRows,        ///< a few rows: less memory, for tiles; whole images filtered this way are smoothed twice
};

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
  static constexpr int kMinSize = 16;

  /// Throws std::invalid_argument when the image is smaller than 16 x 16 px, there is no scale or more than
  /// 8, or a scale is not within 0.5 .. 20 px.
  FrangiFilter(int width, int height, const FrangiSettings& settings,
               FrangiMemory memory = FrangiMemory::kWholeImage);

  /// Filters the whole image. Precondition: `grey` and the maps have width x height pixels.
  void filter(const GreyPixels& grey, const RidgeMaps& maps);
  void filter(const GreyPixels& grey, std::span<float> vesselness) { filter(grey, RidgeMaps{vesselness}); }

  /// Filters the pixels inside the rectangles (they may overlap or reach beyond the image; those narrower
  /// than 16 px are widened); pixels elsewhere keep what they hold. With structureness 0, c is that of the
  /// last whole image, or as renewed or set since; where there has been none, this image's. Pixels are the
  /// same as those of the whole image with equal c.
  void filter_tiles(const GreyPixels& grey, std::span<const PixelRectangle> tiles, const RidgeMaps& maps);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// Parts of the image that renew_structureness() goes through in turn.
  static constexpr int kSlices = 16;

  /// For structureness 0 (does nothing otherwise) without a whole image: c becomes half the greatest Hessian
  /// norm, as far as it is told by the cells where it was greatest in earlier images (see CellNorms) and the
  /// next one of 16 horizontal slices of the image, where something new may have appeared; by all cells the
  /// first time. Depends on the images alone.
  void renew_structureness(const GreyPixels& grey);

  /// c of scale `i`, grey levels: as configured, or found in the last whole image (0: none yet).
  [[nodiscard]] float structureness(std::size_t i) const { return scales_[i].c; }
  /// c of every scale, as another filter found it for this image. Precondition: as many as scales, positive.
  void set_structureness(std::span<const float> c);

  [[nodiscard]] std::size_t scale_count() const { return scales_.size(); }

  /// From now on these ridges count.
  void set_polarity(RidgePolarity polarity) { polarity_ = polarity == RidgePolarity::kDark ? 1.0F : -1.0F; }

 private:
  static constexpr int kStreamedRows = 4;  ///< the three that the Hessian needs, and a power of two

  struct Scale {
    float sigma_px;
    int reach;
    bool integers;                     ///< smoothed in 16 bits where the image is of integers
    std::vector<float> weights;        ///< from the centre outwards
    std::vector<std::uint16_t> pairs;  ///< GaussianTaps::pairs
    float c;
    CellNorms norms;
  };

  /// Columns left <= x < right of one row; none where left >= right.
  struct RowPart {
    int left = 0;
    int right = 0;
  };

  [[nodiscard]] PixelRectangle whole() const { return {0, 0, width_, height_}; }
  [[nodiscard]] bool in_integers(const Scale& scale) const { return scale.integers && integer_image_; }
  [[nodiscard]] PixelRectangle usable(const PixelRectangle& tile) const;
  [[nodiscard]] ResponseScale response_of(const Scale& scale) const;

  void begin_image(const GreyPixels& grey);
  void load(const GreyPixels& grey, const PixelRectangle& part);
  void load_row(const GreyPixels& grey, int y, const RowPart& part);
  template <typename Pixel>
  void load_row_of(const Pixel* grey, int y, const RowPart& part, bool whole_numbers);
  void choose_gain(const GreyPixels& grey);

  void smooth(const Scale& scale, int y, int begin, int end, float* out);
  void stream(const Scale& scale, const PixelRectangle& block, const RidgeMaps& maps);
  void find_structureness(Scale& scale);
  void find_structureness_in_cells(const GreyPixels& grey);
  void find_structureness_near_greatest(const GreyPixels& grey, Scale& scale);
  void measure_cell_norms(const GreyPixels& grey, Scale& scale);
  void measure_cell_norms(Scale& scale, const PixelRectangle& row_of_cells);
  [[nodiscard]] static float norm_of(float squared, const ResponseScale& response);
  [[nodiscard]] static float structureness_of(float max_norm);
  void stream_scales(const PixelRectangle& part, const RidgeMaps& maps);
  void respond_everywhere(const Scale& scale, const RidgeMaps& maps);

  int width_;
  int height_;
  float polarity_;  ///< 1 dark, -1 bright
  float per_blob_;
  bool fixed_c_;
  bool any_integer_scale_;
  bool any_float_scale_;
  bool keeps_whole_image_;
  bool integer_image_ = false;              ///< the loaded image is of 8 or 16 bits
  int next_slice_ = -1;                     ///< -1: none has been measured
  ImageArea cells_;                         ///< whose norms are measured next
  ImageArea measured_cells_;                ///< whose norms are of the present image
  std::vector<PixelRectangle> rectangles_;  ///< of cells_
  int shift_ = 0;                           ///< loaded integers are grey values times 2^shift
  std::vector<Scale> scales_;
  int margin_;
  PaddedPlane<float> source_;
  PaddedPlane<std::uint16_t> source_words_;  ///< of one row where 16-bit smoothing is not configured
  PaddedPlane<float> between_;               ///< one row
  PaddedPlane<std::uint16_t> between_words_;
  PaddedPlane<float> smoothed_;      ///< row y of the image at y + 1; while streaming, the last four rows
  std::vector<float> column_norms_;  ///< scratch: greatest squared norm of each column of a row of cells
  std::vector<RowPart> loaded_;      ///< of each row of the source, of the present image
  std::vector<const float*> rows_;
  std::vector<const std::uint16_t*> word_rows_;
};

}  // namespace tubed
