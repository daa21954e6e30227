// How well a registration is known: the covariance of a small rigid motion by which the true T_world_em
// differs from the one that is used. Values from [em]; whoever takes coils to the world asks it how far they
// may be off.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

namespace tubed {

using RegistrationCovariance = Eigen::Matrix<double, 6, 6>;

/// Numbers of the upper triangle of a 6 x 6 matrix.
inline constexpr std::size_t kRegistrationCovarianceCount = 21;

/// A registered point p lies in truth at p + w x (p - c) + v with a small turn w (rad) about the centre c and
/// a shift v (mm), both along the world's axes, of mean zero.
struct RegistrationQuality {
  RegistrationCovariance covariance = RegistrationCovariance::Zero();  ///< of (w, v): rad^2, rad mm, mm^2
  Eigen::Vector3d centre_world_mm = Eigen::Vector3d::Zero();           ///< c

  /// The same about another centre: of (w, v'), where v' = v + w x (p - c) is the shift of the point itself.
  [[nodiscard]] RegistrationCovariance covariance_at(const Eigen::Vector3d& p_world_mm) const {
    const Eigen::Vector3d d = p_world_mm - centre_world_mm;
    RegistrationCovariance motion = RegistrationCovariance::Identity();
    // w x d = -d x w
    motion.bottomLeftCorner<3, 3>() << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
    return motion * covariance * motion.transpose();
  }

  /// One standard deviation along and about each of the world's axes.
  struct Sigma {
    Eigen::Vector3d turn_rad;
    Eigen::Vector3d shift_mm;
  };
  [[nodiscard]] Sigma sigma_at(const Eigen::Vector3d& p_world_mm) const {
    const Eigen::Matrix<double, 6, 1> sigma = covariance_at(p_world_mm).diagonal().cwiseMax(0).cwiseSqrt();
    return {sigma.head<3>(), sigma.tail<3>()};
  }

  /// Root of the expected squared distance of a registered point from where it is, mm.
  [[nodiscard]] double expected_error_mm(const Eigen::Vector3d& p_world_mm) const {
    return sigma_at(p_world_mm).shift_mm.norm();
  }
};

/// The upper triangle by rows, as em.registration_covariance has it.
inline std::vector<double> upper_triangle(const RegistrationCovariance& covariance) {
  std::vector<double> numbers;
  numbers.reserve(kRegistrationCovarianceCount);
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      numbers.push_back(covariance(row, column));
    }
  }
  return numbers;
}

/// The matrix of kRegistrationCovarianceCount numbers.
inline RegistrationCovariance from_upper_triangle(const std::vector<double>& numbers) {
  RegistrationCovariance covariance;
  std::size_t next = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      covariance(row, column) = covariance(column, row) = numbers.at(next++);
    }
  }
  return covariance;
}

}  // namespace tubed
