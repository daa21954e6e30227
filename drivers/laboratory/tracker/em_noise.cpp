#include "drivers/laboratory/tracker/em_noise.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace tubed {

Eigen::Vector3d noisy_position(const Eigen::Vector3d& p_mm, double lambda_mm, CounterRandom& random) {
  const double r1 = random.signed_unit();
  const double r2 = random.signed_unit();
  const double r3 = random.signed_unit();
  // Eq. (19): length lambda, direction of three uniform numbers in [-1, 1].
  return p_mm + lambda_mm * Eigen::Vector3d(r1, r2, r3).normalized();
}

Eigen::Vector3d noisy_tangent(const Eigen::Vector3d& tangent, double psi_rad, CounterRandom& random) {
  // Eq. (20): turned by psi about an axis that is uniform on the sphere.
  const double theta = std::acos(2 * random.unit() - 1);
  const double phi = 2 * std::numbers::pi * random.unit();
  const Eigen::Vector3d axis(std::cos(theta) * std::sin(phi), std::sin(theta) * std::sin(phi), std::cos(phi));
  return (Eigen::AngleAxisd(psi_rad, axis) * tangent).normalized();
}

}  // namespace tubed
