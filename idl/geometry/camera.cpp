#include "idl/geometry/camera.hpp"

#include <Eigen/LU>
#include <utility>

namespace tubed {
namespace {

/// Normalised image coordinates (x / z, y / z) after distortion, and their derivative with respect to those
/// before.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d J_distorted_undistorted;
};

double radial_factor(const std::array<double, 5>& distortion, double r2) {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  return 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
}

Eigen::Vector2d tangential_shift(const std::array<double, 5>& distortion, const Eigen::Vector2d& point) {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double x = point.x();
  const double y = point.y();
  const double r2 = point.squaredNorm();
  return {2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

/// Radial (k1 k2 k3) and tangential (p1 p2) distortion as OpenCV defines it.
Distorted distort(const std::array<double, 5>& distortion, const Eigen::Vector2d& point) {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double x = point.x();
  const double y = point.y();
  const double r2 = point.squaredNorm();
  const double radial = radial_factor(distortion, r2);
  const double radial_slope = k1 + r2 * (2 * k2 + r2 * 3 * k3);  // d radial / d r2
  const double mixed = 2 * x * y * radial_slope + 2 * p1 * x + 2 * p2 * y;
  Distorted distorted;
  distorted.point = point * radial + tangential_shift(distortion, point);
  distorted.J_distorted_undistorted << radial + 2 * x * x * radial_slope + 2 * p1 * y + 6 * p2 * x, mixed,
      mixed, radial + 2 * y * y * radial_slope + 6 * p1 * y + 2 * p2 * x;
  return distorted;
}

}  // namespace

std::optional<Eigen::Vector3d> CameraCalibration::looked_at_world_mm() const {
  // The world's origin lies at T_camera_world.translation() in the camera frame.
  const double depth_mm = source_isocentre_mm > 0 ? source_isocentre_mm : T_camera_world.translation().z();
  if (!(depth_mm > 0)) {
    return std::nullopt;
  }
  return T_camera_world.inverse() * Eigen::Vector3d(0, 0, depth_mm);
}

void CameraCalibration::look_from(const ViewGeometry& view) {
  fx = view.fx;
  fy = view.fy;
  cx = view.cx;
  cy = view.cy;
  T_camera_world = view.T_camera_world();
}

Camera::Camera(CameraCalibration calibration)
    : calibration_(std::move(calibration)),
      at_construction_{calibration_.fx, calibration_.fy, calibration_.cx, calibration_.cy,
                       calibration_.T_camera_world} {}

void Camera::look_from(const std::optional<ViewGeometry>& view) {
  if (view) {
    calibration_.look_from(*view);
    return;
  }
  calibration_.fx = at_construction_.fx;
  calibration_.fy = at_construction_.fy;
  calibration_.cx = at_construction_.cx;
  calibration_.cy = at_construction_.cy;
  calibration_.T_camera_world = at_construction_.T_camera_world;
}

std::optional<Projection> Camera::project(const Eigen::Vector3d& p_world_mm) const {
  const Eigen::Vector3d p_camera_mm = calibration_.T_camera_world * p_world_mm;
  const double depth_mm = p_camera_mm.z();
  if (!(depth_mm > 0)) return std::nullopt;  // also refuses NaN

  const Eigen::Vector2d normalised = p_camera_mm.head<2>() / depth_mm;
  const Distorted distorted = distort(calibration_.distortion, normalised);
  const Eigen::Vector2d focal_px(calibration_.fx, calibration_.fy);
  Eigen::Matrix<double, 2, 3> J_normalised_camera;
  J_normalised_camera << 1, 0, -normalised.x(), 0, 1, -normalised.y();
  J_normalised_camera /= depth_mm;

  Projection projection;
  projection.p_image_px =
      focal_px.cwiseProduct(distorted.point) + Eigen::Vector2d(calibration_.cx, calibration_.cy);
  projection.J_image_world = focal_px.asDiagonal() * distorted.J_distorted_undistorted * J_normalised_camera *
                             calibration_.T_camera_world.linear();
  projection.depth_mm = depth_mm;
  return projection;
}

Eigen::Vector3d Camera::ray_camera(const Eigen::Vector2d& p_image_px) const {
  constexpr int kMaxRounds = 100;
  constexpr double kTolerance = 1e-12;
  const Eigen::Vector2d distorted((p_image_px.x() - calibration_.cx) / calibration_.fx,
                                  (p_image_px.y() - calibration_.cy) / calibration_.fy);
  Eigen::Vector2d point = distorted;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Eigen::Vector2d next = (distorted - tangential_shift(calibration_.distortion, point)) /
                                 radial_factor(calibration_.distortion, point.squaredNorm());
    const double step = (next - point).cwiseAbs().maxCoeff();
    point = next;
    if (step < kTolerance) break;
  }
  return point.homogeneous();
}

bool Camera::contains(const Eigen::Vector2d& p_image_px, double margin_px) const {
  return p_image_px.x() >= margin_px && p_image_px.x() <= calibration_.width - 1 - margin_px &&
         p_image_px.y() >= margin_px && p_image_px.y() <= calibration_.height - 1 - margin_px;
}

}  // namespace tubed
