// Normal deviates of the laboratory's random numbers.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "drivers/laboratory/random/counter_random.hpp"

namespace tubed {

/// Standard normal, by Box and Muller.
inline double gaussian(CounterRandom& random) {
  const double radius = std::sqrt(-2 * std::log(1 - random.unit()));
  return radius * std::cos(2 * std::numbers::pi * random.unit());
}

/// Three of them; its direction is uniform on the sphere.
inline Eigen::Vector3d gaussian_vector(CounterRandom& random) {
  const double x = gaussian(random);
  const double y = gaussian(random);
  return {x, y, gaussian(random)};
}

}  // namespace tubed
