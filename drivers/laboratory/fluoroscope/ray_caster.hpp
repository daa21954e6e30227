// Line integrals through a volume of voxels.
#pragma once

#include <Eigen/Core>
#include <span>

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"
#include "drivers/laboratory/fluoroscope/body_motion.hpp"

namespace tubed {

/// Integrates attenuation along rays after Joseph, "An improved algorithm for reprojecting rays through pixel
/// images" (IEEE Trans Med Imaging 1, 1982): one sample a plane of voxels across the ray's main axis,
/// interpolated within the plane. Keeps a reference to the volume. Callable from any thread.
class RayCaster {
 public:
  explicit RayCaster(const AttenuationVolume& volume);

  /// Attenuation along the ray from `source_room_mm` in `direction_room` (any length) to infinity; no unit.
  [[nodiscard]] float line_integral(const Eigen::Vector3d& source_room_mm,
                                    const Eigen::Vector3d& direction_room) const;
  /// What movement changes in the line integral: `changes`[k] for the posture (k + 1) / n of `far` of n.
  void changes(const Eigen::Vector3d& source_room_mm, const Eigen::Vector3d& direction_room,
               const BodyMotion& motion, const Posture& far, std::span<float> changes) const;

 private:
  struct Walk;
  [[nodiscard]] Walk walk(const Eigen::Vector3d& source_room_mm, const Eigen::Vector3d& direction_room) const;
  /// Interpolated between eight voxels, in their units; beyond the border the last voxel goes on.
  [[nodiscard]] float sample(const Eigen::Vector3f& index) const;

  const AttenuationVolume& volume_;
  RigidTransform T_volume_room_;
  Eigen::Vector3d last_;      ///< index of the last voxel, along each axis
  Eigen::Array3f last_cell_;  ///< the same, a hair less
  Eigen::Vector3i stride_;    ///< of the voxels, along each axis
};

}  // namespace tubed
