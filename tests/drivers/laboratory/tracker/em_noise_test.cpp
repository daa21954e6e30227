#include "drivers/laboratory/tracker/em_noise.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tubed {
namespace {

constexpr int kDraws = 20'000;
constexpr double kLambda_mm = 4;
constexpr double kPsi_rad = 3 * std::numbers::pi / 180;

TEST(EmNoise, APositionIsOffByExactlyLambda) {
  const Eigen::Vector3d p_mm(10, -20, 30);
  for (int k = 0; k < 1000; ++k) {
    CounterRandom random(1, 2, k);
    ASSERT_NEAR((noisy_position(p_mm, kLambda_mm, random) - p_mm).norm(), kLambda_mm, 1e-12);
  }
}

TEST(EmNoise, APositionIsUnbiasedWithLambdaOverRootThreeAnAxis) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (int k = 0; k < kDraws; ++k) {
    CounterRandom random(7, 1, k);
    const Eigen::Vector3d noise_mm = noisy_position(Eigen::Vector3d::Zero(), kLambda_mm, random);
    sum += noise_mm;
    squares += noise_mm.cwiseProduct(noise_mm);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / kDraws, 0, 0.08);  // 5 standard errors
    EXPECT_NEAR(std::sqrt(squares[axis] / kDraws), 2.3094, 0.04) << axis;
  }
}

TEST(EmNoise, DirectionsComeFromTheCubeNotFromTheSphere) {
  // The greatest component exceeds 0.9 within a cone about each axis. Of each face of the cube, 4 in area,
  // the cone takes a disc of radius^2 1 / 0.81 - 1: 0.184 of all draws. Uniform on the sphere it would be 3
  // (1 - 0.9) = 0.3.
  const double cone = std::numbers::pi / 4 * (1 / 0.81 - 1);
  int along_an_axis = 0;
  for (int k = 0; k < kDraws; ++k) {
    CounterRandom random(3, 5, k);
    const Eigen::Vector3d direction = noisy_position(Eigen::Vector3d::Zero(), 1, random);
    along_an_axis += direction.cwiseAbs().maxCoeff() > 0.9 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(along_an_axis) / kDraws, cone, 0.015);
}

TEST(EmNoise, ATangentStaysUnitAndTurnsByAtMostPsi) {
  const Eigen::Vector3d tangent = Eigen::Vector3d(1, 2, -2) / 3;
  double max_rad = 0;
  for (int k = 0; k < kDraws; ++k) {
    CounterRandom random(1, 1, k);
    const Eigen::Vector3d noisy = noisy_tangent(tangent, kPsi_rad, random);
    ASSERT_NEAR(noisy.norm(), 1, 1e-14);
    max_rad = std::max(max_rad, std::atan2(noisy.cross(tangent).norm(), noisy.dot(tangent)));
  }
  EXPECT_LE(max_rad, kPsi_rad + 1e-12);
  EXPECT_GT(max_rad, 0.999 * kPsi_rad);
}

/// Mean square of the axis' component along t, from cos(angle) = cos psi + (1 - cos psi) (a t)^2.
double mean_square_of_axis_along(const Eigen::Vector3d& tangent) {
  double sum = 0;
  for (int k = 0; k < kDraws; ++k) {
    CounterRandom random(11, 4, k);
    const double cosine = noisy_tangent(tangent, kPsi_rad, random).dot(tangent);
    sum += (cosine - std::cos(kPsi_rad)) / (1 - std::cos(kPsi_rad));
  }
  return sum / kDraws;
}

TEST(EmNoise, TheAxisIsDistributedAsEquation20IsPrinted) {
  // E cos^2 theta = 1/3 for theta = acos(2 r - 1), E sin^2 phi = 1/2 for uniform phi.
  EXPECT_NEAR(mean_square_of_axis_along(Eigen::Vector3d::UnitX()), 1.0 / 6, 0.01);
  EXPECT_NEAR(mean_square_of_axis_along(Eigen::Vector3d::UnitY()), 1.0 / 3, 0.01);
  EXPECT_NEAR(mean_square_of_axis_along(Eigen::Vector3d::UnitZ()), 1.0 / 2, 0.01);
}

TEST(EmNoise, ADrawDependsOnSeedCoilAndMeasurementAndOnNothingElse) {
  const auto draw = [](int seed, int coil, int k) { return CounterRandom(seed, coil, k).unit(); };
  EXPECT_EQ(draw(1, 2, 3), draw(1, 2, 3));
  EXPECT_NE(draw(1, 2, 3), draw(2, 2, 3));
  EXPECT_NE(draw(1, 2, 3), draw(1, 3, 3));
  EXPECT_NE(draw(1, 2, 3), draw(1, 2, 4));
  EXPECT_NE(draw(1, 2, 3), draw(1, 3, 2));
}

}  // namespace
}  // namespace tubed
