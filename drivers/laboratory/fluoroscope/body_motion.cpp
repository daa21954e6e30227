#include "drivers/laboratory/fluoroscope/body_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tubed {

namespace {

/// 0 below `from`, 1 above `to`, smooth between.
float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

/// The part of a period that has gone by at `time_s`, 0 .. 1.
double phase(double time_s, double period_s) {
  const double periods = time_s / period_s;
  return periods - std::floor(periods);
}

}  // namespace

Posture BodyMotion::posture(double time_s, const ClutterStates& clutter) const {
  using std::numbers::pi;
  Posture posture;
  if (clutter.heart_beat && settings_.heart_phases > 0) {
    // The systole takes a third of the beat, the filling the rest.
    const double p = phase(time_s, settings_.heart_period_s);
    constexpr double kSystole = 0.35;
    const double turn = p < kSystole ? p / kSystole : 1 - (p - kSystole) / (1 - kSystole);
    posture.systole = static_cast<float>((1 - std::cos(pi * turn)) / 2);
  }
  if (clutter.breathing && settings_.breathing_phases > 0) {
    // A pause at the end of the expiration: cos^4 rather than cos.
    const double wave = std::sin(pi * phase(time_s, settings_.breathing_period_s));
    posture.inspiration = static_cast<float>(std::pow(wave, 4));
  }
  return posture;
}

Eigen::Vector3f BodyMotion::breath(const Eigen::Vector3f& p_room_mm) const {
  constexpr float kLungHeight_mm = 190;
  const Eigen::Vector3f heart = settings_.heart_centre_room_mm.cast<float>();
  const auto dome = static_cast<float>(settings_.diaphragm_z_room_mm);
  const float depth = 1 - 0.9F * smooth_step(dome, dome + kLungHeight_mm, p_room_mm.z());
  // Between chest wall and spine: an ellipse about the heart's axis, a little to its right.
  const float across = (p_room_mm.x() - heart.x() + 34) / 150;
  const float fore_aft = (p_room_mm.y() - heart.y() - 4) / 105;
  const float from_axis = std::sqrt(across * across + fore_aft * fore_aft);
  const float inside = 1 - smooth_step(0.5F, 0.9F, from_axis);
  const float travel = static_cast<float>(settings_.diaphragm_travel_mm) * depth * inside;
  return {0, -0.15F * travel, -travel};
}

Eigen::Vector3f BodyMotion::beat(const Eigen::Vector3f& p_room_mm) const {
  const Eigen::Vector3f from_centre = p_room_mm - settings_.heart_centre_room_mm.cast<float>();
  const auto radius = static_cast<float>(settings_.heart_radius_mm);
  const float share = from_centre.squaredNorm() / (radius * radius);
  if (share >= 1) {
    return Eigen::Vector3f::Zero();
  }
  const float near = (1 - share) * (1 - share);
  // The bump takes away from the squeeze at the heart's wall, which lies at two thirds of the radius.
  constexpr float kAtWall = 3.2F;
  return -static_cast<float>(settings_.heart_squeeze) * kAtWall * near * from_centre;
}

Eigen::Vector3f BodyMotion::displacement(const Eigen::Vector3f& p_room_mm, const Posture& posture) const {
  Eigen::Vector3f moved = Eigen::Vector3f::Zero();
  if (posture.inspiration > 0) {
    moved += posture.inspiration * breath(p_room_mm);
  }
  if (posture.systole > 0) {
    moved += posture.systole * beat(p_room_mm);
  }
  return moved;
}

}  // namespace tubed
