#include "drivers/laboratory/tracker/smooth_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/gaussian.hpp"

namespace tubed {

SmoothField::SmoothField(std::int64_t seed, std::int64_t stream, double max,
                         const Eigen::AlignedBox3d& volume_mm) {
  constexpr int kWaves = 6;
  constexpr double kShortest_mm = 350;
  constexpr double kMax_mm = 900;
  constexpr int kLooks = 16;  ///< an axis
  if (max == 0) {
    return;
  }
  CounterRandom random(seed, stream, 0);
  for (int wave = 0; wave < kWaves; ++wave) {
    const Eigen::Vector3d amplitude = gaussian_vector(random);
    const Eigen::Vector3d direction = gaussian_vector(random).normalized();
    const double length_mm = kShortest_mm + (kMax_mm - kShortest_mm) * random.unit();
    waves_.push_back(
        {amplitude, 2 * std::numbers::pi / length_mm * direction, 2 * std::numbers::pi * random.unit()});
  }
  double found = 0;
  for (int i = 0; i < kLooks * kLooks * kLooks; ++i) {
    const Eigen::Array3d share(i % kLooks, i / kLooks % kLooks, i / kLooks / kLooks);
    const Eigen::Vector3d p_mm =
        volume_mm.min().array() + volume_mm.sizes().array() * share / static_cast<double>(kLooks - 1);
    found = std::max(found, at(p_mm).norm());
  }
  for (Wave& wave : waves_) {
    wave.amplitude *= max / found;
  }
}

Eigen::Vector3d SmoothField::at(const Eigen::Vector3d& p_mm) const noexcept {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Wave& wave : waves_) {
    sum += wave.amplitude * std::cos(wave.wave_number_per_mm.dot(p_mm) + wave.phase_rad);
  }
  return sum;
}

Eigen::Matrix3d SmoothField::gradient(const Eigen::Vector3d& p_mm) const noexcept {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Wave& wave : waves_) {
    const double slope = -std::sin(wave.wave_number_per_mm.dot(p_mm) + wave.phase_rad);
    sum += slope * wave.amplitude * wave.wave_number_per_mm.transpose();
  }
  return sum;
}

}  // namespace tubed
