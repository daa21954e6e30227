// A patient as X-rays see him: attenuation on a regular grid of voxels.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// Linear attenuation, 1/mm, at the centres of a grid; outside is air. Voxel (i, j, k) lies at
/// spacing * (i, j, k) in the volume's frame. 16 bit a voxel: steps of 2e-6 / mm, up to 0.131 / mm.
class AttenuationVolume {
 public:
  static constexpr float kUnit_per_mm = 2e-6F;

  /// All air. Throws std::invalid_argument for fewer than 2 voxels along an axis, more than 2^31 in all, or
  /// a spacing that is not positive and finite.
  AttenuationVolume(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm,
                    const RigidTransform& T_room_volume);

  [[nodiscard]] const Eigen::Vector3i& size() const { return size_; }
  [[nodiscard]] const Eigen::Vector3d& spacing_mm() const { return spacing_mm_; }
  [[nodiscard]] const RigidTransform& T_room_volume() const { return T_room_volume_; }

  [[nodiscard]] float at(int i, int j, int k) const {
    return static_cast<float>(voxels_[index(i, j, k)]) * kUnit_per_mm;
  }
  /// Clamped to what 16 bit hold.
  void set(int i, int j, int k, float attenuation_per_mm);
  /// Voxels with x fastest, then y; in units of kUnit_per_mm.
  [[nodiscard]] const std::uint16_t* voxels() const { return voxels_.data(); }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size_.y()) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] Eigen::Vector3d centre_room_mm() const;

 private:
  Eigen::Vector3i size_;
  Eigen::Vector3d spacing_mm_;
  RigidTransform T_room_volume_;
  std::vector<std::uint16_t> voxels_;
};

}  // namespace tubed
