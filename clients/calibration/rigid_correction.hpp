// By what shift and turn do all coils lie beside the tube that images show?
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "drivers/interface/registration_quality.hpp"

namespace tubed {

/// One place of the tube beside a coil: an image has the tube `off_mm` further along `side` than the coil is.
struct SeenBesideCoil {
  std::size_t coil = 0;
  std::size_t place = 0;  ///< of that coil, from 0: where the tracker's field bends it in another way
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();   ///< the coil, as registered
  Eigen::Vector3d side_world = Eigen::Vector3d::UnitX();  ///< unit; across the tube in that image's plane
  double off_mm = 0;
};

/// A registered point p lies in truth at p + w x (p - c) + v, as RegistrationQuality has it.
struct RigidCorrection {
  Eigen::Vector3d centre_world_mm = Eigen::Vector3d::Zero();           ///< c: the mean of the coils' places
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();                  ///< w
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();                  ///< v
  RegistrationCovariance covariance = RegistrationCovariance::Zero();  ///< of (w, v)
  double local_mm = 0;  ///< standard deviation an axis of what each coil is off by, at each of its places
  double rms_before_mm = 0;  ///< of off_mm
  double rms_after_mm = 0;
  std::size_t left_out = 0;  ///< sightings that contradict the others

  /// Standard deviation of the shift of c along the direction in which it is known worst, mm.
  [[nodiscard]] double worst_shift_mm() const;
  /// That direction; unit, world.
  [[nodiscard]] Eigen::Vector3d worst_direction() const;
};

/// off = side . (v + w x (p - c) + e + noise), where e is an error of each coil at each place. How large e
/// is, the evidence (LinearEvidence) says: all sizes from 0.1 to 6 mm are as likely before, and what results
/// is their mixture. Nothing is known of v and w before. Sightings beyond 4 standard deviations are left out;
/// those of a coil, in the order of time, count by how much their neighbours differ. Nothing for fewer than 3
/// coils or kMinSightings.
std::optional<RigidCorrection> find_rigid_correction(std::span<const SeenBesideCoil> seen);

inline constexpr std::size_t kMinSightings = 40;

}  // namespace tubed
