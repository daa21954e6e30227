// Shadows of steel balls in a radiograph.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "clients/calibration/calibration_picture.hpp"

namespace tubed {

/// One shadow.
struct FoundBall {
  Eigen::Vector2d p_image_px;  ///< middle of the ellipse
  double diameter_px = 0;
  double contrast = 0;  ///< grey levels; negative: darker than around it
  double noise = 0;     ///< of its pixels, grey levels
  double sigma_px = 0;  ///< of the middle along either axis, from the pixels' noise alone
};

/// What shadows look like.
struct BallLook {
  enum class Polarity { kEither, kDark, kBright };
  Polarity polarity = Polarity::kEither;  ///< kEither: whichever gives more of them
  double min_diameter_px = 3;
  double max_diameter_px = 40;
};

/// Finds discs by the extrema of differences of Gaussians over place and scale (Lindeberg, IJCV 30, 1998),
/// and fits a soft disc to each. Strongest contrast to noise first. Balls cut by the border or overlapping
/// each other are left out.
std::vector<FoundBall> find_balls(const CalibrationPicture& picture, const BallLook& look = {});

}  // namespace tubed
