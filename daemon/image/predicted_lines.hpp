// Where on its correspondence lines a tube was expected before its image was looked at.
#pragma once

#include <Eigen/Core>

#include "daemon/image/projected_lines.hpp"

namespace tubed {

/// Coefficients of the tube's curve as a Gaussian, before the image. Neither is owned.
struct TubePrediction {
  const Eigen::Matrix3Xd* mean_mm;        ///< 3 x n or wider, world
  const Eigen::MatrixXd* covariance_mm2;  ///< its first 3 n rows and columns, coefficient by coefficient
};

/// Fills expected_px and expected_variance_px2 of the first layout.count lines, as project_lines() has laid
/// them out, that are in view: the predicted point of the same arc length, seen across the line's own tube;
/// along itself the prediction may be off by more. A point that the camera cannot see is not expected
/// anywhere. Never allocates.
void predict_lines(const Camera& camera, const UniformCubicBSpline& spline, const TubePrediction& prediction,
                   const LineLayout& layout, CorrespondenceLines& lines);

}  // namespace tubed
