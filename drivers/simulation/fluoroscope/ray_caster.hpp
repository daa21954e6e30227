// Line integrals through a volume of voxels.
#pragma once

#include <Eigen/Core>

#include "drivers/simulation/fluoroscope/attenuation_volume.hpp"
#include "drivers/simulation/fluoroscope/body_motion.hpp"

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
  /// The same with the tissue displaced as `motion` says at `posture`.
  [[nodiscard]] float line_integral(const Eigen::Vector3d& source_room_mm,
                                    const Eigen::Vector3d& direction_room, const BodyMotion& motion,
                                    const Posture& posture) const;

 private:
  struct Walk;
  [[nodiscard]] Walk walk(const Eigen::Vector3d& source_room_mm, const Eigen::Vector3d& direction_room) const;
  [[nodiscard]] float sample(const Eigen::Vector3f& index) const;

  const AttenuationVolume& volume_;
  RigidTransform T_volume_room_;
  Eigen::Vector3d last_;    ///< index of the last voxel, along each axis
  Eigen::Vector3i stride_;  ///< of the voxels, along each axis
};

}  // namespace tubed
