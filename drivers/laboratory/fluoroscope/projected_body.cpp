#include "drivers/laboratory/fluoroscope/projected_body.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/laboratory/fluoroscope/ray_caster.hpp"

namespace tubed {

namespace {

/// What moving to 1/n, 2/n, ... of the way to `far` changes in each pixel.
std::vector<std::vector<float>> phases_to(const Posture& far, int count, const PixelRays& rays,
                                          const RayCaster& caster, const BodyMotion& motion) {
  std::vector<std::vector<float>> phases(static_cast<std::size_t>(count), std::vector<float>(rays.size()));
  if (phases.empty()) {
    return phases;
  }
  std::vector<float> changes(phases.size());
  for (std::size_t pixel = 0; pixel < rays.size(); ++pixel) {
    caster.changes(rays.source_room_mm(), rays.direction_room(pixel), motion, far, changes);
    for (std::size_t phase = 0; phase < phases.size(); ++phase) {
      phases[phase][pixel] = changes[phase];
    }
  }
  return phases;
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
  systole_ = phases_to({1, 0}, motion.heart_phases, rays, caster, body);
  inspiration_ = phases_to({0, 1}, motion.breathing_phases, rays, caster, body);
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
