// A line across a tube's projection, on which an image is asked where the tube is.
#pragma once

#include <Eigen/Core>

namespace tubed {

inline constexpr int kMaxCorrespondenceLines = 256;

/// One line: before the search its base and direction, after it what was found.
struct CorrespondenceLine {
  Eigen::Vector2d base_px = Eigen::Vector2d::Zero();  ///< projected centreline point
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< unit, normal to the projected centreline
  double half_width_px = 0;                           ///< of the tube's projection; 0 where nobody asks
  bool in_view = false;                               ///< set by the caller; the others are passed over
  double expected_px = 0;                             ///< offset at which the tube was predicted, and
  double expected_variance_px2 = 0;                   ///< its variance; 0: nobody has predicted any
  double offset_px = 0;                               ///< found: mean of the posterior along the normal
  double variance_px2 = 0;                            ///< found: its variance
  bool agrees = false;                                ///< the image shows a ridge there, and no edge
};

}  // namespace tubed
