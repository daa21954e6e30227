#include "drivers/laboratory/instrument/catheter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tubed {
namespace {

using std::numbers::pi;

constexpr double kLength_mm = 200;  // a whole number of segments

CatheterProperties uniform() {
  CatheterProperties properties;
  properties.tip_bending_stiffness_N_mm2 = properties.bending_stiffness_N_mm2;
  return properties;
}

Introducer upward() { return {{0, 0, 0}, Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX()}; }

Catheter free_rod() { return {uniform(), upward(), nullptr, {}, kLength_mm}; }

TEST(Catheter, ACantileverBendsAsForceTimesLengthCubedOverThreeEI) {
  Catheter rod = free_rod();
  const double force_N = 2e-5;
  rod.pull_tip({force_N, 0, 0});

  const StepReport report = rod.apply({});

  const double expected_mm = force_N * std::pow(kLength_mm, 3) / (3 * 70);
  EXPECT_TRUE(report.converged && report.stable);
  EXPECT_NEAR(rod.shape().at(0).p_world_mm.x(), expected_mm, 0.01 * expected_mm);
}

/// Euler's load of a column clamped at one end.
double buckling_load_N() { return pi * pi * 70 / (4 * kLength_mm * kLength_mm); }

/// Pushed at the tip with `share` of Euler's load after a touch toward `side`.
Catheter pushed(double share, const Eigen::Vector3d& side) {
  Catheter rod = free_rod();
  rod.pull_tip(1e-5 * side - share * buckling_load_N() * Eigen::Vector3d::UnitZ());
  rod.apply({});
  rod.pull_tip(-share * buckling_load_N() * Eigen::Vector3d::UnitZ());
  rod.apply({});
  return rod;
}

TEST(Catheter, BelowEulersLoadItStraightensAgain) {
  const Catheter rod = pushed(0.95, {0, 1, 0});
  EXPECT_LT(rod.shape().at(0).p_world_mm.head<2>().norm(), 0.2);
}

TEST(Catheter, AboveEulersLoadItBucklesToTheSideItWasTouchedOnAsTheElasticaSays) {
  // Clamped elastica: P / P_E = (2 K(k) / pi)^2, deflection / length = 2 k / K(k) (Love, 1927, section 263).
  double k = 0.1;
  for (int round = 0; round < 200; ++round) {
    k += 0.5 * (pi / 2 * std::sqrt(1.1) - std::comp_ellint_1(k));
  }
  const double expected_mm = kLength_mm * 2 * k / std::comp_ellint_1(k);
  for (const Eigen::Vector3d& side : {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(-0.6, -0.8, 0)}) {
    const Eigen::Vector3d tip_mm = pushed(1.1, side).shape().at(0).p_world_mm;
    EXPECT_NEAR(tip_mm.head<2>().norm(), expected_mm, 0.03 * expected_mm);
    EXPECT_GT(tip_mm.head<2>().normalized().dot(side.head<2>()), 0.999);
  }
}

TEST(Catheter, AnUnloadedBentTipIsACircleTowardItsRoll) {
  Catheter rod = free_rod();
  rod.apply({0, pi / 2, 0});  // the reference is x: roll by 90 deg bends toward y
  for (int i = 0; i < 9; ++i) {
    rod.apply({0, 0, 10 * pi / 180});
  }

  // 90 deg over 50 mm: a circle of radius 100 / pi beside the end of the straight part. The catheter's last
  // half segment is rigid, the bendable part begins behind it.
  const double radius_mm = 100 / pi;
  const Eigen::Vector3d centre_mm(0, radius_mm, kLength_mm - 50 - rod.spacing_mm() / 2);
  for (double s_mm = 2; s_mm < 48; s_mm += 1) {
    EXPECT_NEAR((rod.shape().at(s_mm).p_world_mm - centre_mm).norm(), radius_mm, 0.02) << s_mm;
  }
  EXPECT_NEAR(rod.shape().at(100).p_world_mm.head<2>().norm(), 0, 1e-6);
}

/// A tube that is straight for 80 mm and then turns a quarter circle of `radius_mm` toward x, 1.6 mm wide
/// inside.
Vessel quarter_turn(double radius_mm) {
  std::vector<VesselStation> stations;
  for (double z = -20; z < 80; z += 1) {
    stations.push_back({{0, 0, z}, 1.6});
  }
  for (double angle = 0; angle < pi / 2; angle += 1 / radius_mm) {
    stations.push_back({{radius_mm * (1 - std::cos(angle)), 0, 80 + radius_mm * std::sin(angle)}, 1.6});
  }
  std::vector<LumenBall> balls;
  append_tube(stations, balls);
  return {WallField::of_balls(balls, 0.5), upward(), {stations.begin() + 20, stations.end()}};
}

TEST(Catheter, InANarrowRoundTubeItIsTheTubesCircle) {
  const Vessel tube = quarter_turn(40);
  CatheterProperties properties = uniform();
  properties.wall_stiffness_N_mm2 = 2;
  Catheter rod(properties, tube.introducer, &tube.wall, tube.route, 100);

  double max_penetration_mm = 0;
  for (int step = 0; step < 35; ++step) {
    const StepReport report = rod.apply({1, 0, 0});
    ASSERT_TRUE(report.converged) << step;
    max_penetration_mm = std::max(max_penetration_mm, report.max_penetration_mm);
  }

  // Clearance 0.435 mm: between radius 39.5 and 40.5; away from the ends the turn a mm is 1 / 40.
  EXPECT_LT(max_penetration_mm, 0.2);
  const Eigen::Vector3d centre_mm(40, 0, 80);
  for (double s_mm = 5; s_mm < 50; s_mm += 1) {
    EXPECT_NEAR((rod.shape().at(s_mm).p_world_mm - centre_mm).norm(), 40, 0.6) << s_mm;
  }
  const double turned = std::acos(rod.shape().at(10).tangent_world.dot(rod.shape().at(40).tangent_world));
  EXPECT_NEAR(turned, 30.0 / 40, 0.03);
}

TEST(Catheter, ForcesAreTheGradientOfTheEnergy) {
  std::vector<LumenBall> balls;
  for (int i = -20; i < 200; ++i) {
    balls.push_back({{8 * std::sin(0.03 * i), 0, static_cast<double>(i)}, 4});
  }
  const WallField wall = WallField::of_balls(balls);
  Catheter rod({}, upward(), &wall, {}, 110);
  rod.apply({0, 0, 0.7});
  rod.apply({0, 0.8, 0});
  srand(3);
  Eigen::Matrix3Xd nodes = rod.nodes_world_mm();
  nodes.leftCols(rod.free_nodes()) += 0.3 * Eigen::Matrix3Xd::Random(3, rod.free_nodes());
  Eigen::Matrix3Xd gradient;
  Eigen::Matrix3Xd unused;
  rod.energy(nodes, gradient);

  constexpr double kStep_mm = 1e-5;
  for (Eigen::Index i = 0; i < 3 * rod.free_nodes(); ++i) {
    Eigen::Matrix3Xd moved = nodes;
    moved(i) += kStep_mm;
    const double above = rod.energy(moved, unused);
    moved(i) -= 2 * kStep_mm;
    EXPECT_NEAR(gradient(i), (above - rod.energy(moved, unused)) / (2 * kStep_mm), 1e-5) << i;
  }
}

TEST(Catheter, RetractedAsFarAsItWasInsertedItLiesWhereItLay) {
  const Vessel tube = quarter_turn(40);
  Catheter rod(uniform(), tube.introducer, &tube.wall, tube.route, 110);
  rod.apply({1, 0, 0});
  const Eigen::Vector3d before = rod.shape().at(0).p_world_mm;
  for (int step = 0; step < 10; ++step) {
    rod.apply({1, 0, 0});
  }
  for (int step = 0; step < 10; ++step) {
    rod.apply({-1, 0, 0});
  }
  EXPECT_LT((rod.shape().at(0).p_world_mm - before).norm(), 0.01);
}

TEST(Catheter, RetractionIntoTheIntroducerIsRefused) {
  Catheter rod = free_rod();
  EXPECT_THROW(rod.apply({-160, 0, 0}), std::invalid_argument);
  EXPECT_THROW(Catheter({}, upward(), nullptr, {}, 40), std::invalid_argument);
}

}  // namespace
}  // namespace tubed
