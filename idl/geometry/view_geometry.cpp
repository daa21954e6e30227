#include "idl/geometry/view_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <span>

#include "idl/geometry/camera.hpp"

namespace tubed {

namespace {

constexpr double kUnitTolerance = 1e-3;
constexpr double kMaxSigmaRotation_rad = 0.5;
constexpr double kMaxSigmaTranslation_mm = 1000;
constexpr double kMaxPivotDepth_mm = 1e4;
constexpr double kMaxTranslation_mm = 1e5;
constexpr double kMaxDepthRatio = 4;

bool all_within(std::span<const double> values, double minimum, double maximum) {
  return std::all_of(values.begin(), values.end(),
                     [&](double value) { return value >= minimum && value <= maximum; });  // false for NaN
}

double norm_of(const std::array<double, 4>& q) { return Eigen::Map<const Eigen::Vector4d>(q.data()).norm(); }

bool is_finite(const ViewGeometry& g) {
  const auto finite = [](std::span<const double> values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  const std::array rest{g.fx, g.fy, g.cx, g.cy, g.sigma.pivot_depth_mm};
  return finite(rest) && finite(g.q_camera_world) && finite(g.t_camera_world_mm) &&
         finite(g.sigma.rotation_rad) && finite(g.sigma.translation_mm);
}

bool has_sound_sigma(const PoseSigma& sigma) {
  return all_within(sigma.rotation_rad, 0, kMaxSigmaRotation_rad) &&
         all_within(sigma.translation_mm, 0, kMaxSigmaTranslation_mm) && sigma.pivot_depth_mm >= 0 &&
         sigma.pivot_depth_mm <= kMaxPivotDepth_mm;
}

const char* refusal_of_depth(const ViewGeometry& geometry, const CameraCalibration& configured) {
  const auto p_world_mm = configured.looked_at_world_mm();
  if (!p_world_mm) {
    return nullptr;
  }
  const double configured_mm = (configured.T_camera_world * *p_world_mm).z();
  const double depth_mm = (geometry.T_camera_world() * *p_world_mm).z();
  if (!(depth_mm > 0)) {
    return "its pose puts what the configured view looks at behind the camera; expected p_camera = "
           "T_camera_world * p_world, not the inverse";
  }
  if (configured.source_detector_mm > 0 && depth_mm >= configured.source_detector_mm) {
    return "its pose puts what the configured view looks at behind the detector; expected less than the "
           "source-detector distance, in mm";
  }
  if (depth_mm < configured_mm / kMaxDepthRatio || depth_mm > configured_mm * kMaxDepthRatio) {
    return "its pose puts what the configured view looks at at less than a quarter or more than four times "
           "its depth; expected mm";
  }
  return nullptr;
}

}  // namespace

RigidTransform ViewGeometry::T_camera_world() const {
  const auto& [w, x, y, z] = q_camera_world;
  RigidTransform transform = RigidTransform::Identity();
  transform.linear() = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  transform.translation() = Eigen::Map<const Eigen::Vector3d>(t_camera_world_mm.data());
  return transform;
}

ViewGeometry geometry_of(const CameraCalibration& camera) {
  const Eigen::Quaterniond q(camera.T_camera_world.linear());
  const Eigen::Vector3d t_mm = camera.T_camera_world.translation();
  return {.fx = camera.fx,
          .fy = camera.fy,
          .cx = camera.cx,
          .cy = camera.cy,
          .q_camera_world = {q.w(), q.x(), q.y(), q.z()},
          .t_camera_world_mm = {t_mm.x(), t_mm.y(), t_mm.z()},
          .sigma = {}};
}

const char* refusal_of(const ViewGeometry& geometry, const CameraCalibration& configured) {
  if (!is_finite(geometry)) {
    return "a number of its geometry is not finite";
  }
  const std::array focal_px{geometry.fx, geometry.fy};
  const std::array principal_px{geometry.cx, geometry.cy};
  if (!all_within(focal_px, kMinFocal_px, kMaxFocal_px)) {
    return "its focal lengths are not 1 to 1e6 px";
  }
  if (!all_within(principal_px, -kMaxPrincipal_px, kMaxPrincipal_px)) {
    return "its principal point is not within 1e4 px";
  }
  if (std::abs(norm_of(geometry.q_camera_world) - 1) > kUnitTolerance) {
    return "its pose is no rotation: the quaternion w x y z is not of length 1";
  }
  if (!all_within(geometry.t_camera_world_mm, -kMaxTranslation_mm, kMaxTranslation_mm)) {
    return "the translation of its pose is not within 1e5 mm";
  }
  if (!has_sound_sigma(geometry.sigma)) {
    return "the standard deviations of its pose are not 0 to 0.5 rad and 0 to 1000 mm, about an axis at a "
           "depth of 0 to 1e4 mm";
  }
  return refusal_of_depth(geometry, configured);
}

}  // namespace tubed
