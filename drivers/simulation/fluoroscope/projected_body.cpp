#include "drivers/simulation/fluoroscope/projected_body.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/simulation/fluoroscope/ray_caster.hpp"

namespace tubed {

namespace {

/// What tissue displaced to `posture` changes in each pixel.
std::vector<float> change(const PixelRays& rays, const RayCaster& caster, const BodyMotion& motion,
                          const Posture& posture, std::span<const float> rest) {
  std::vector<float> difference(rays.size());
  for (std::size_t pixel = 0; pixel < rays.size(); ++pixel) {
    // A still posture through the same sampling, so that nothing but the movement is left.
    difference[pixel] = rest[pixel] == 0 ? 0
                                         : caster.line_integral(rays.source_room_mm(),
                                                                rays.direction_room(pixel), motion, posture) -
                                               rest[pixel];
  }
  return difference;
}

}  // namespace

ProjectedBody::ProjectedBody(const PixelRays& rays, const AttenuationVolume& volume,
                             const MotionSettings& motion)
    : rest_(rays.size()) {
  const RayCaster caster(volume);
  for (std::size_t pixel = 0; pixel < rays.size(); ++pixel) {
    rest_[pixel] = caster.line_integral(rays.source_room_mm(), rays.direction_room(pixel));
  }
  const BodyMotion body(motion);
  const auto part = [](int phase, int count) {
    return static_cast<float>(phase) / static_cast<float>(count);
  };
  for (int phase = 1; phase <= motion.heart_phases; ++phase) {
    systole_.push_back(change(rays, caster, body, {part(phase, motion.heart_phases), 0}, rest_));
  }
  for (int phase = 1; phase <= motion.breathing_phases; ++phase) {
    inspiration_.push_back(change(rays, caster, body, {0, part(phase, motion.breathing_phases)}, rest_));
  }
}

void ProjectedBody::add_phase(const std::vector<std::vector<float>>& phases, float amount,
                              std::span<float> integrals) const {
  if (phases.empty() || amount <= 0) {
    return;
  }
  const float place = std::min(amount, 1.0F) * static_cast<float>(phases.size());
  const auto above = std::min(static_cast<std::size_t>(place), phases.size() - 1);
  const float part = place - static_cast<float>(above);
  const float* const next = phases[above].data();
  if (above == 0) {
    for (std::size_t pixel = 0; pixel < integrals.size(); ++pixel) {
      integrals[pixel] += part * next[pixel];
    }
    return;
  }
  const float* const last = phases[above - 1].data();
  for (std::size_t pixel = 0; pixel < integrals.size(); ++pixel) {
    integrals[pixel] += last[pixel] + part * (next[pixel] - last[pixel]);
  }
}

void ProjectedBody::at(const Posture& posture, std::span<float> integrals) const {
  std::copy(rest_.begin(), rest_.end(), integrals.begin());
  add_phase(systole_, posture.systole, integrals);
  add_phase(inspiration_, posture.inspiration, integrals);
}

}  // namespace tubed
