// Smooth random fields: what makes tissue look uneven.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "drivers/laboratory/fluoroscope/counted_noise.hpp"

namespace tubed {

/// Values of a periodic lattice (64 cells along each axis), interpolated. A pure function of the seed.
class TissueTexture {
 public:
  explicit TissueTexture(std::int64_t seed) : lattice_(kCells * kCells * kCells) {
    const std::uint64_t key = noise_key(seed, 77, 0);
    for (std::size_t i = 0; i < lattice_.size(); ++i) {
      lattice_[i] = static_cast<float>(2 * unit_noise(key + i) - 1);
    }
  }

  /// Within -1 .. 1, mean 0, uneven over about `scale_mm`.
  [[nodiscard]] float at(const Eigen::Vector3d& p_mm, double scale_mm) const {
    const Eigen::Vector3f place = (p_mm / scale_mm).cast<float>().array() + kFar;
    const Eigen::Vector3i cell = place.cast<int>();
    const Eigen::Vector3f t = place - cell.cast<float>();
    const auto row = [&](int y, int z) {
      const float left = value(cell.x(), y, z);
      return left + t.x() * (value(cell.x() + 1, y, z) - left);
    };
    const auto plane = [&](int z) {
      const float low = row(cell.y(), z);
      return low + t.y() * (row(cell.y() + 1, z) - low);
    };
    const float low = plane(cell.z());
    return low + t.z() * (plane(cell.z() + 1) - low);
  }
  /// The same without interpolation: for scales of about a voxel.
  [[nodiscard]] float nearest(const Eigen::Vector3d& p_mm, double scale_mm) const {
    const Eigen::Vector3i cell = ((p_mm / scale_mm).array() + kFar).cast<int>();
    return 0.6F * value(cell.x(), cell.y(), cell.z());
  }

 private:
  static constexpr int kCells = 64;
  static constexpr float kFar = 1024;  ///< so that truncation rounds down

  [[nodiscard]] float value(int x, int y, int z) const {
    return lattice_[static_cast<std::size_t>(((z & 63) * kCells + (y & 63)) * kCells + (x & 63))];
  }

  std::vector<float> lattice_;
};

}  // namespace tubed
