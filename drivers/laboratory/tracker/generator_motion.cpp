#include "drivers/laboratory/tracker/generator_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tubed {

RigidTransform GeneratorMotion::T_rest_em(double t_s) const {
  RigidTransform moved = RigidTransform::Identity();
  if (shift_mm == 0 && turn_rad == 0 && drift_mm_s == 0) {
    return moved;
  }
  const double part = std::clamp((t_s - at_s) / std::max(push_s, 1e-9), 0.0, 1.0);
  const Eigen::Vector3d along = Eigen::Vector3d(2, -1, 1).normalized();
  const Eigen::Vector3d drift_along = Eigen::Vector3d(-1, 1, 2).normalized();
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -1).normalized();
  moved.linear() = Eigen::AngleAxisd(part * turn_rad, axis).toRotationMatrix();
  moved.translation() = part * shift_mm * along + std::max(t_s, 0.0) * drift_mm_s * drift_along;
  return moved;
}

GeneratorMotion generator_motion(const DriverSettings& settings) {
  return {settings.get<double>("generator_shift_mm"),
          settings.get<double>("generator_turn_deg") * std::numbers::pi / 180,
          settings.get<double>("generator_moves_at_s"), settings.get<double>("generator_push_s"),
          settings.get<double>("generator_drift_mm_s")};
}

RigidTransform T_world_reference() { return RigidTransform(Eigen::Translation3d(70, 40, 60)); }

std::array<ReferenceCoil, 2> coils_of_reference() {
  return {ReferenceCoil{{-15, 0, 0}, Eigen::Vector3d::UnitZ()},
          ReferenceCoil{{15, 0, 0}, Eigen::Vector3d::UnitY()}};
}

}  // namespace tubed
