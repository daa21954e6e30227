// What of an exposure shows whether the view has moved: the background's texture, reduced to about 1.2 mm a
// pixel, without brightness, contrast, noise and blades.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "daemon/image/blade_finder.hpp"
#include "daemon/image/box_blur.hpp"
#include "drivers/interface/image_source.hpp"

namespace tubed {

/// Texture in units of 1 / kTextureUnit of its local standard deviation: sums of products of whole numbers
/// are the same on every machine, and cheap.
using TextureGrid = Eigen::Array<std::int16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr int kTextureUnit = 512;
constexpr int kMaxTexture = 3;  ///< standard deviations: texture is clipped there

/// The reduced texture of one exposure: local contrast in units of its own local standard deviation, clipped
/// at +-3; 0 where nothing is open.
struct ViewPicture {
  TextureGrid texture;
  OpenGrid open;  ///< 1 inside the collimator's opening, 0 behind a blade

  /// Share of the picture that is open, 0 .. 1.
  [[nodiscard]] float open_share() const;
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
  void weigh(const OpenGrid& open);
  void smooth(const PixelGrid& from, PixelGrid& to);
  void high_pass();
  void write_texture(TextureGrid& texture);

  int width_;
  int factor_;
  PixelGrid mean_;              ///< grey, 0 .. 255; 0 where nothing is open
  PixelGrid contrast_, large_;  ///< of high_pass()
  PixelGrid open_;              ///< 0, 1
  /// open_ over what of a window is open: normalised convolution, G * (open f) / G * open.
  PixelGrid over_small_, over_large_, over_spread_;
  OpenGrid weighed_;  ///< what open_ and the weights are of
  BladeFinder blades_;
  BoxBlur large_blur_;
  BoxBlur spread_blur_;
  std::vector<std::uint32_t> column_sums_;             ///< of some rows of full pixels
  Eigen::Array<float, 1, Eigen::Dynamic> three_rows_;  ///< of smooth()
};

}  // namespace tubed
