// How a view stood when one image was taken. C-arms turn, tables pan and fields of view change: what the
// configuration says of a camera holds where an image brings nothing of its own.
#pragma once

#include <array>

#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

struct CameraCalibration;

/// What is not known of a pose: the true p_camera' is off the stated p_camera by a small turn and a small
/// shift,
///   p_camera' = p_camera + w x (p_camera - (0, 0, pivot_depth_mm)) + v,
/// where w and v have the components below as independent standard deviations, along the camera's axes x, y,
/// z. One draw holds for a whole image; those of different images are taken for independent.
struct PoseSigma {
  std::array<double, 3> rotation_rad{};    ///< of w
  std::array<double, 3> translation_mm{};  ///< of v
  /// Depth at which the turn's axes cross the camera's z axis. Of a C-arm, whose angles err about its
  /// isocentre: the source-isocentre distance. 0: the camera's centre.
  double pivot_depth_mm = 0;

  /// Nothing is said: the pose is taken for exact.
  [[nodiscard]] bool is_zero() const {
    return rotation_rad == std::array<double, 3>{} && translation_mm == std::array<double, 3>{};
  }
};

/// Intrinsics and pose of one image; distortion stays the camera's. As it came: refusal_of() says whether it
/// can be used.
struct ViewGeometry {
  double fx = 0, fy = 0;                      ///< focal lengths, px
  double cx = 0, cy = 0;                      ///< principal point, px; the first pixel's centre is 0
  std::array<double, 4> q_camera_world{};     ///< w x y z, of length 1: the rotation of T_camera_world
  std::array<double, 3> t_camera_world_mm{};  ///< its translation
  PoseSigma sigma;

  /// p_camera = T_camera_world * p_world. Precondition: q_camera_world is not 0.
  [[nodiscard]] RigidTransform T_camera_world() const;

  friend bool operator==(const ViewGeometry& a, const ViewGeometry& b) {
    return a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy &&
           a.q_camera_world == b.q_camera_world && a.t_camera_world_mm == b.t_camera_world_mm;
  }
};

/// The geometry that a calibration states, its pose as exact.
ViewGeometry geometry_of(const CameraCalibration& camera);

/// What of an image's geometry counts.
enum class GeometryUse {
  kConfiguration,  ///< nothing: that of the configuration holds for every image
  kImage,          ///< all; an image without one has the configuration's
  kRequired,       ///< all; an image without one is refused
};

/// Why a geometry cannot be that of an image of `configured`; nullptr when it can. Refused are numbers that
/// are not finite, focal lengths and principal points that no configuration may have either, a quaternion
/// that is not of length 1 within 1e-3, negative or huge standard deviations, and a pose with which what
/// the configured view looks at (CameraCalibration::looked_at_world_mm()) lies behind the camera, behind
/// its detector, or at a depth that is less than a quarter of the configured one or more than four times it,
/// as a pose that is inverted or in metres has it. Never allocates.
const char* refusal_of(const ViewGeometry& geometry, const CameraCalibration& configured);

}  // namespace tubed
