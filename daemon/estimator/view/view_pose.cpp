#include "daemon/estimator/view/view_pose.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace tubed {

namespace {

/// [a]x b = a x b.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

}  // namespace

ViewPose::ViewPose(const ViewGeometry& geometry, double pivot_depth_mm) : geometry_(geometry) {
  geometry_.sigma = {};
  geometry_.sigma.pivot_depth_mm = pivot_depth_mm;
}

// Finite turns are rotations: with w as a rotation vector, p' = R(w) (p - pivot) + pivot + v.
ViewPose ViewPose::with_error(const Error& e) const {
  ViewPose moved = *this;
  const Eigen::Vector3d w = e.head<3>();
  const double angle_rad = w.norm();
  const Eigen::Quaterniond turn(angle_rad > 0 ? Eigen::AngleAxisd(angle_rad, w / angle_rad)
                                              : Eigen::AngleAxisd::Identity());
  const RigidTransform T = geometry_.T_camera_world();
  const Eigen::Vector3d pivot_mm = pivot_depth_mm() * Eigen::Vector3d::UnitZ();
  const Eigen::Quaterniond q = (turn * Eigen::Quaterniond(T.linear())).normalized();
  moved.geometry_.q_camera_world = {q.w(), q.x(), q.y(), q.z()};
  Eigen::Map<Eigen::Vector3d>(moved.geometry_.t_camera_world_mm.data()) =
      turn * (T.translation() - pivot_mm) + pivot_mm + e.tail<3>();
  return moved;
}

ViewPose::Jacobian ViewPose::jacobian(const Eigen::Vector3d& p_camera_mm) const {
  Jacobian J;
  // w x d = -[d]x w
  J.leftCols<3>() = -cross_matrix(p_camera_mm - pivot_depth_mm() * Eigen::Vector3d::UnitZ());
  J.rightCols<3>().setIdentity();
  return J;
}

Eigen::Matrix3d ViewPose::covariance_across(const Eigen::Vector3d& p_world_mm) const {
  const RigidTransform T = geometry_.T_camera_world();
  const Eigen::Vector3d p_camera_mm = T * p_world_mm;
  const Eigen::Vector3d ray = p_camera_mm.normalized();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
  const Jacobian J = T.linear().transpose() * across * jacobian(p_camera_mm);
  return J * P_ * J.transpose();
}

void ViewPose::set_covariance(const Covariance& P) {
  P_ = P;
  for (int i = 0; i < 3; ++i) {
    geometry_.sigma.rotation_rad[static_cast<std::size_t>(i)] = std::sqrt(P_(i, i));
    geometry_.sigma.translation_mm[static_cast<std::size_t>(i)] = std::sqrt(P_(i + 3, i + 3));
  }
}

void ViewPose::add_sigma(double rotation_rad, double translation_mm) {
  Covariance P = P_;
  P.diagonal().head<3>().array() += rotation_rad * rotation_rad;
  P.diagonal().tail<3>().array() += translation_mm * translation_mm;
  set_covariance(P);
}

}  // namespace tubed
