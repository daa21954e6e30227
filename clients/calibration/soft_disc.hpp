// A disc with soft edges on an even slope: what a ball's shadow looks like, fitted to pixels.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "clients/calibration/calibration_picture.hpp"

namespace tubed {

/// Grey at a distance rho from the centre:
///   g + gx dx + gy dy + contrast * (1 - hollow rho^2 / r^2) * erfc((rho - r) / (sqrt(2) s)) / 2
/// with r the radius, s the softness of the edge and hollow how much the shadow thins toward its edge: 0 for
/// a coin, about 0.5 for the chords of a ball.
struct SoftDisc {
  Eigen::Vector2d p_image_px;  ///< centre
  double radius_px = 0;
  double softness_px = 0;
  double hollow = 0;
  double contrast = 0;   ///< grey levels; negative: darker than around it
  double noise = 0;      ///< standard deviation of what the disc leaves of the pixels, grey levels
  double explained = 0;  ///< part of the pixels' variance about an even slope that the disc explains, <= 1
  double sigma_px = 0;   ///< of the centre along either axis, if pixels were independent
};

/// Part of an image that shows something else.
struct OtherDisc {
  Eigen::Vector2d p_image_px;
  double radius_px = 0;
};

/// Fits the pixels around the centre by Levenberg's and Marquardt's method from a first guess.
/// Nothing when they reach beyond the picture, when the fit does not settle, or its centre leaves the first
/// guess by more than its radius (or 1.5 px). Pixels of `others` do not count.
std::optional<SoftDisc> fit_soft_disc(const CalibrationPicture& picture, const Eigen::Vector2d& centre_px,
                                      double radius_px, double contrast,
                                      const std::vector<OtherDisc>& others = {});

}  // namespace tubed
