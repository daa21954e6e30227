#include "clients/evaluation/consistency.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace tubed {

namespace {

constexpr double kMinAcross =
    0.05;  // sine of the angle to its ray, under which a tube has no side in the image

std::size_t stretch_of(double s_mm) {
  const auto found = std::ranges::find_if(kConsistencyStretches,
                                          [s_mm](const auto& stretch) { return s_mm < stretch.to_mm; });
  return static_cast<std::size_t>(found - kConsistencyStretches.begin());
}

}  // namespace

void NormalisedErrors::add(double squared_error_mm2, double variance_mm2) {
  if (!(variance_mm2 > 0)) return;
  const double square = squared_error_mm2 / variance_mm2;
  ++count;
  sum_of_squares += square;
  beyond_3_sigma += square > 9 ? 1 : 0;
}

void Consistency::add(const EstimatedShape& shape, const SampledCentreline& truth, const Camera& view,
                      double s_max_mm) {
  const SampledCentreline& estimate = shape.centreline;
  if (shape.covariance_world_mm2.cols() != estimate.p_world_mm.cols() ||
      !shape.covariance_world_mm2.allFinite()) {
    return;
  }
  const RigidTransform& T_camera_world = view.calibration().T_camera_world;
  for (Eigen::Index i = 0; i + 1 < estimate.p_world_mm.cols(); ++i) {
    const double s_mm = estimate.s_mm[static_cast<std::size_t>(i)];
    if (s_mm > s_max_mm || s_mm > truth.s_mm.back()) break;
    const Eigen::Vector3d p_mm = estimate.p_world_mm.col(i);
    const Eigen::Vector3d ray = T_camera_world.linear().transpose() * (T_camera_world * p_mm).normalized();
    const Eigen::Vector3d tangent = (estimate.p_world_mm.col(i + 1) - p_mm).normalized();
    const Eigen::Vector3d side = ray.cross(tangent);
    if (!(side.norm() > kMinAcross)) continue;
    const Eigen::Vector3d across = side.normalized();
    const Eigen::Vector3d e_mm = p_mm - point_at(truth, s_mm);
    const Eigen::Matrix3d covariance_mm2 = symmetric(shape.covariance_world_mm2.col(i));
    const std::array<Eigen::Vector3d, kSeenDirections.size()> directions{across, across.cross(ray), ray};
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const Eigen::Vector3d& u = directions[k];
      errors_[stretch_of(s_mm)][k].add(u.dot(e_mm) * u.dot(e_mm), u.dot(covariance_mm2 * u));
    }
  }
}

NormalisedErrors Consistency::of(std::size_t direction) const {
  NormalisedErrors all;
  for (const auto& stretch : errors_) {
    all.count += stretch[direction].count;
    all.sum_of_squares += stretch[direction].sum_of_squares;
    all.beyond_3_sigma += stretch[direction].beyond_3_sigma;
  }
  return all;
}

}  // namespace tubed
