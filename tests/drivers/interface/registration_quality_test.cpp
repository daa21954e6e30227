#include "drivers/interface/registration_quality.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace tubed {
namespace {

TEST(RegistrationQuality, AKnownTurnMovesAPointByItsLever) {
  RegistrationQuality quality;
  quality.centre_world_mm = {10, 20, 30};
  quality.covariance(2, 2) = 0.01 * 0.01;  // about z

  const auto sigma = quality.sigma_at({110, 20, 30});

  EXPECT_NEAR(sigma.shift_mm.x(), 0, 1e-12);
  EXPECT_NEAR(sigma.shift_mm.y(), 0.01 * 100, 1e-12);
  EXPECT_NEAR(sigma.shift_mm.z(), 0, 1e-12);
  EXPECT_NEAR(sigma.turn_rad.z(), 0.01, 1e-12);
}

TEST(RegistrationQuality, AboutAnotherCentreAMotionIsTheSameMotion) {
  // One motion (w, v) as a covariance of rank one: its shift at p is v + w x (p - c).
  const Eigen::Vector3d w(0.01, -0.02, 0.03);
  const Eigen::Vector3d v(0.4, 0.5, -0.6);
  RegistrationQuality quality;
  quality.centre_world_mm = {1, 2, 3};
  Eigen::Matrix<double, 6, 1> motion;
  motion << w, v;
  quality.covariance = motion * motion.transpose();
  const Eigen::Vector3d p_world_mm(40, -30, 70);

  Eigen::Matrix<double, 6, 1> there;
  there << w, v + w.cross(p_world_mm - quality.centre_world_mm);

  EXPECT_TRUE(quality.covariance_at(p_world_mm).isApprox(there * there.transpose(), 1e-12));
  EXPECT_NEAR(quality.expected_error_mm(p_world_mm), there.tail<3>().norm(), 1e-9);
}

TEST(RegistrationQuality, TheUpperTriangleIsReadByRows) {
  std::vector<double> numbers;
  for (int i = 0; i < 21; ++i) numbers.push_back(i);

  const RegistrationCovariance covariance = from_upper_triangle(numbers);

  EXPECT_EQ(covariance(0, 5), 5);
  EXPECT_EQ(covariance(1, 1), 6);
  EXPECT_EQ(covariance(5, 0), 5);
  EXPECT_EQ(covariance(5, 5), 20);
  EXPECT_EQ(upper_triangle(covariance), numbers);
}

}  // namespace
}  // namespace tubed
