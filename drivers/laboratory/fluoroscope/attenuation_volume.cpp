#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tubed {

AttenuationVolume::AttenuationVolume(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm,
                                     const RigidTransform& T_room_volume)
    : size_(size), spacing_mm_(spacing_mm), T_room_volume_(T_room_volume) {
  if (size.minCoeff() < 2) {
    throw std::invalid_argument("attenuation volume: needs at least 2 voxels along each axis");
  }
  if (!spacing_mm.allFinite() || spacing_mm.minCoeff() <= 0) {
    throw std::invalid_argument(
        "attenuation volume: the voxels' spacing has to be positive and finite, in mm");
  }
  const double count = size.cast<double>().prod();
  if (count > 0x1p31) {
    throw std::invalid_argument("attenuation volume: more than 2^31 voxels; use a coarser grid");
  }
  voxels_.resize(static_cast<std::size_t>(count));
}

void AttenuationVolume::set(int i, int j, int k, float attenuation_per_mm) {
  const float units = std::round(attenuation_per_mm / kUnit_per_mm);
  voxels_[index(i, j, k)] = static_cast<std::uint16_t>(std::clamp(units, 0.0F, 65535.0F));
}

Eigen::Vector3d AttenuationVolume::centre_room_mm() const {
  const Eigen::Vector3d last = (size_ - Eigen::Vector3i::Ones()).cast<double>().cwiseProduct(spacing_mm_);
  return T_room_volume_ * (last / 2);
}

}  // namespace tubed
