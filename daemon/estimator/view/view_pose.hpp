// A camera's pose as a Gaussian: where it stands, and how far it may be off.
#pragma once

#include <Eigen/Core>

#include "idl/geometry/view_geometry.hpp"

namespace tubed {

/// The error is that of PoseSigma: the true p_camera' is off the pose's p_camera by
///   p_camera' = p_camera + w x (p_camera - (0, 0, pivot_depth)) + v,
/// here with a covariance of (w, v) as a whole, in rad and mm.
class ViewPose {
 public:
  using Error = Eigen::Matrix<double, 6, 1>;       ///< w, v
  using Covariance = Eigen::Matrix<double, 6, 6>;  ///< of (w, v): rad^2, rad mm, mm^2
  using Jacobian = Eigen::Matrix<double, 3, 6>;    ///< of p_camera' by (w, v)

  ViewPose() = default;
  /// Known exactly. `pivot_depth_mm`: about the depth of what is looked at.
  ViewPose(const ViewGeometry& geometry, double pivot_depth_mm);

  /// The most likely one; its sigma is covariance()'s diagonal.
  [[nodiscard]] const ViewGeometry& geometry() const { return geometry_; }
  [[nodiscard]] const Covariance& covariance() const { return P_; }
  [[nodiscard]] double pivot_depth_mm() const { return geometry_.sigma.pivot_depth_mm; }

  /// The pose that this one would be with such an error; the covariance stays.
  [[nodiscard]] ViewPose with_error(const Error& e) const;

  /// How a point that lies at `p_camera_mm` moves with (w, v).
  [[nodiscard]] Jacobian jacobian(const Eigen::Vector3d& p_camera_mm) const;

  /// What the pose leaves open of where `p_world_mm` projects: covariance of its displacement across its ray,
  /// mm^2, world.
  [[nodiscard]] Eigen::Matrix3d covariance_across(const Eigen::Vector3d& p_world_mm) const;

  void set_covariance(const Covariance& P);
  /// Independent standard deviations of all axes, added.
  void add_sigma(double rotation_rad, double translation_mm);

 private:
  ViewGeometry geometry_;
  Covariance P_ = Covariance::Zero();
};

/// A pose with which an image shows the tube where coils say that it is.
struct PoseMatch {
  ViewPose pose;
  double log_evidence = 0;
  bool is_found = false;
};

}  // namespace tubed
