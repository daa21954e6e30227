// How far a point is from the vessel's wall: what the catheter's contact is computed from.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace tubed {

/// A ball that is wholly inside the lumen. A vessel is the union of many, close together.
struct LumenBall {
  Eigen::Vector3d centre_world_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;
};

/// Signed distance from the wall at one point, positive in the lumen, and how it changes with the point.
struct WallDistance {
  double distance_mm = 0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian_per_mm = Eigen::Matrix3d::Zero();
};

/// The wall as a cubic B-spline over a regular grid of signed distances: twice continuously differentiable,
/// at a cost that does not depend on the vessel. The wall IS the zero level of this field; smoothing moves it
/// from the sampled shape by about spacing^2 / (6 R) at a radius of curvature R (0.03 mm at 12 mm), and
/// rounds edges. Beyond kReach_mm outside the wall the distance no longer grows. World frame, mm. Immutable,
/// callable from any thread, at() never allocates.
class WallField {
 public:
  static constexpr double kReach_mm = 8;

  /// The union of balls. Throws std::invalid_argument without any ball or with a radius that is not positive.
  static WallField of_balls(std::span<const LumenBall> balls, double spacing_mm = 1.5);

  /// From signed distances at the points origin + spacing (i, j, k), i fastest; `size` points an axis. Values
  /// need to be right near the wall only.
  WallField(const Eigen::Vector3d& origin_mm, double spacing_mm, const Eigen::Array3i& size,
            std::vector<float> distances_mm);

  [[nodiscard]] double distance_mm(const Eigen::Vector3d& p_world_mm) const;
  [[nodiscard]] WallDistance at(const Eigen::Vector3d& p_world_mm) const;
  [[nodiscard]] bool contains(const Eigen::Vector3d& p_world_mm) const { return distance_mm(p_world_mm) > 0; }
  [[nodiscard]] Eigen::AlignedBox3d box_world_mm() const;

 private:
  struct Place;
  [[nodiscard]] Place place(const Eigen::Vector3d& p_world_mm) const;

  Eigen::Vector3d origin_mm_;
  double spacing_mm_;
  Eigen::Array3i size_;
  std::vector<float> distances_mm_;
};

}  // namespace tubed
