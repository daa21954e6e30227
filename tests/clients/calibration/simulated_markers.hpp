// Marker sets whose truth is known.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <string>

#include "clients/calibration/marker_registration.hpp"

namespace tubed {

inline Eigen::Vector3d normal_vector(std::mt19937& random, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

inline Eigen::Vector3d uniform_vector(std::mt19937& random, double half_width) {
  std::uniform_real_distribution<double> uniform(-half_width, half_width);
  const double x = uniform(random);
  const double y = uniform(random);
  return {x, y, uniform(random)};
}

inline RigidTransform random_transform(std::mt19937& random) {
  const Eigen::Vector3d xyz = normal_vector(random, 1);
  std::normal_distribution<double> normal(0, 1);
  RigidTransform transform = RigidTransform::Identity();
  transform.linear() = Eigen::Quaterniond(normal(random), xyz.x(), xyz.y(), xyz.z()).normalized().matrix();
  transform.translation() = uniform_vector(random, 300);
  return transform;
}

/// Markers spread over a box of 160 mm, touched with an error of N(0, sigma^2) along each axis.
struct SimulatedMarkers {
  RigidTransform T_world_em;
  MarkerPairs pairs;

  SimulatedMarkers(std::mt19937& random, int count, double sigma_mm) : T_world_em(random_transform(random)) {
    pairs.p_world_mm.resize(3, count);
    pairs.p_em_mm.resize(3, count);
    for (int i = 0; i < count; ++i) {
      pairs.names.push_back("M" + std::to_string(i + 1));
      pairs.p_world_mm.col(i) = uniform_vector(random, 80);
      pairs.p_em_mm.col(i) = T_world_em.inverse() * pairs.p_world_mm.col(i) + normal_vector(random, sigma_mm);
    }
  }

  /// The small motion (w, v) about `centre_world_mm` that takes registered points to where they are.
  [[nodiscard]] Eigen::Matrix<double, 6, 1> error_of(const RigidTransform& T_estimated,
                                                     const Eigen::Vector3d& centre_world_mm) const {
    const RigidTransform motion = T_world_em * T_estimated.inverse();
    const Eigen::AngleAxisd turn(motion.rotation());
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), motion * centre_world_mm - centre_world_mm;
    return error;
  }
};

}  // namespace tubed
