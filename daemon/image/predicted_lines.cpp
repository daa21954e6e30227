#include "daemon/image/predicted_lines.hpp"

namespace tubed {

namespace {

/// Covariance of a point of the curve: sum of b_i b_j P_ij over the four coefficients that make it.
Eigen::Matrix3d point_covariance(const Eigen::MatrixXd& P, const CubicBasis& basis) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      sum += basis.value[static_cast<std::size_t>(i)] * basis.value[static_cast<std::size_t>(j)] *
             P.block<3, 3>(3 * (basis.first + i), 3 * (basis.first + j));
    }
  }
  return sum;
}

}  // namespace

void predict_lines(const Camera& camera, const UniformCubicBSpline& spline, const TubePrediction& prediction,
                   const LineLayout& layout, CorrespondenceLines& lines) {
  for (int i = 0; i < layout.count; ++i) {
    CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    line.expected_variance_px2 = 0;
    if (!line.in_view) {
      continue;
    }
    const CubicBasis basis = spline.basis(layout.s_mm(i));
    const auto here = camera.project(combine(*prediction.mean_mm, basis.first, basis.value));
    if (!here) {
      continue;
    }
    // Of the offset e = n . (pi(p) - base): de/dp = J^T n.
    const Eigen::Vector3d gradient = here->J_image_world.transpose() * line.normal;
    line.expected_px = line.normal.dot(here->p_image_px - line.base_px);
    line.expected_variance_px2 = gradient.dot(point_covariance(*prediction.covariance_mm2, basis) * gradient);
  }
}

}  // namespace tubed
