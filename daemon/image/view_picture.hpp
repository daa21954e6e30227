// What of an exposure shows whether the view has moved: the background's texture, reduced to about 1.2 mm a
// pixel, without brightness, contrast, noise and blades.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "drivers/interface/image_source.hpp"

namespace tubed {

/// Rows are image rows, so that a row is contiguous.
using PixelGrid = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The reduced texture of one exposure: local contrast in units of its own local standard deviation, clipped
/// at +-3; 0 where nothing is open.
struct ViewPicture {
  PixelGrid texture;
  PixelGrid open;  ///< 1 inside the collimator's opening, 0 behind a blade

  /// Share of the picture that is open, 0 .. 1.
  [[nodiscard]] float open_share() const { return open.size() == 0 ? 0 : open.mean(); }
};

/// Sums over a square window, three times one after another: nearly a Gaussian of standard deviation
/// `sigma_px`. Outside the grid is 0. Memory is taken in the constructor.
class BoxBlur {
 public:
  BoxBlur(Eigen::Index rows, Eigen::Index columns, double sigma_px);
  /// Blurs in place; the sum of all weights is 1.
  void apply(PixelGrid& values);

 private:
  int radius_;
  PixelGrid between_;
  std::vector<float> sums_;
};

/// Makes ViewPictures of one camera's exposures. One thread; memory is taken in the constructor.
class ViewReducer {
 public:
  /// Size of the exposures, px. Throws std::invalid_argument below 64 x 64.
  ViewReducer(int width, int height);

  /// Full pixels along one side of a reduced one.
  [[nodiscard]] int factor() const { return factor_; }
  [[nodiscard]] Eigen::Index rows() const { return mean_.rows(); }
  [[nodiscard]] Eigen::Index columns() const { return mean_.cols(); }

  /// An empty picture of the right size, for reduce().
  [[nodiscard]] ViewPicture picture() const;

  /// `frame`: of the size given above, with pixels. `white_level`: grey value of a saturated pixel. Never
  /// allocates.
  void reduce(const ImageFrame& frame, float white_level, ViewPicture& picture);

 private:
  template <typename Pixel>
  void average(const Pixel* pixels, float scale);
  void find_blades(PixelGrid& open);
  void measure_spread();
  void shut_from(Eigen::Index row, Eigen::Index column, PixelGrid& open);
  void high_pass(ViewPicture& picture);
  void normalise(PixelGrid& values, const PixelGrid& weights) const;

  int width_;
  int factor_;
  PixelGrid mean_;    ///< grey, 0 .. 255
  PixelGrid spread_;  ///< greatest minus least grey of 3 x 3 reduced pixels
  PixelGrid smooth_;
  PixelGrid large_;
  PixelGrid weights_small_, weights_large_, weights_spread_;
  PixelGrid last_open_;
  BoxBlur large_blur_;
  BoxBlur spread_blur_;
  float flat_spread_ = 0;  ///< grey levels: less is flat
  std::vector<float> some_spreads_;
  std::vector<std::int32_t> queue_;
};

}  // namespace tubed
