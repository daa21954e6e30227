// Where a picture is open, and where a collimator's blade is.
#pragma once

#include <cstdint>
#include <vector>

#include "daemon/image/box_blur.hpp"

namespace tubed {

/// 1 where a picture is open, 0 behind a blade.
using OpenGrid = Eigen::Array<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Finds blades: they touch the border and carry no noise. Dark bone carries none either where it is
/// saturated, but lies inside. One thread; memory is taken in the constructor.
class BladeFinder {
 public:
  /// For reduced pictures of that size.
  BladeFinder(Eigen::Index rows, Eigen::Index columns);

  /// `grey`: 0 .. 255. Shuts what lies behind blades, and two pixels around them; opens everything else.
  void find(const PixelGrid& grey, OpenGrid& open);

 private:
  void measure_spread(const PixelGrid& grey);
  [[nodiscard]] float flat_spread();
  void shut_flat_from_border(OpenGrid& open);
  void shut_margin(OpenGrid& open);

  PixelGrid spread_;  ///< greatest minus least grey of 3 x 3 pixels; at the border as beside it
  Eigen::Array<float, 1, Eigen::Dynamic> greatest_, least_;  ///< of three rows
  OpenGrid between_;
  std::vector<float> some_spreads_;
  std::vector<std::int32_t> queue_;  ///< places that were shut
};

}  // namespace tubed
