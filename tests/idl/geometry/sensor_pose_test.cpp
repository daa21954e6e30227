#include "idl/geometry/sensor_pose.hpp"
#include "idl/geometry/degree.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tubed {
namespace {

constexpr SensorSigma kSigma{0.4, 0.5 * kDegree};

RigidTransform some_pose() {
  const Eigen::AngleAxisd turn(0.9, Eigen::Vector3d(1, -2, 0.5).normalized());
  return Eigen::Translation3d(120, -40, -210) * turn;
}

/// 30 mm apart along x, axes along z and y.
TwoCoils some_body() {
  return {CoilPose{{-15, 0, 0}, Eigen::Vector3d::UnitZ()}, CoilPose{{15, 0, 0}, Eigen::Vector3d::UnitY()}};
}

TwoCoils seen(const RigidTransform& T, TwoCoils coils) {
  for (CoilPose& coil : coils) {
    coil = {T * coil.p_mm, T.linear() * coil.axis};
  }
  return coils;
}

Eigen::Vector3d drawn(std::mt19937& random, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  return {normal(random), normal(random), normal(random)};
}

TEST(SensorPose, OfSixDegreesOfFreedomIsExact) {
  const RigidTransform T = some_pose();
  const auto pose = pose_of_sensor(T.translation(), T.linear().col(2), T.linear().col(0), kSigma);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->T_em_body.matrix() - T.matrix()).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(pose->covariance(0, 0), kSigma.angle_rad * kSigma.angle_rad);
  EXPECT_DOUBLE_EQ(pose->covariance(5, 5), 0.16);
}

TEST(SensorPose, WithoutOrientationIsNone) {
  const double nan = std::nan("");
  const Eigen::Vector3d p(1, 2, 3);
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  EXPECT_FALSE(pose_of_sensor(p, z, {nan, nan, nan}, kSigma));
  EXPECT_FALSE(pose_of_sensor(p, z, z, kSigma)) << "x along z";
  EXPECT_FALSE(pose_of_sensor({nan, 0, 0}, z, Eigen::Vector3d::UnitX(), kSigma));
  EXPECT_FALSE(pose_of_sensor(p, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), kSigma));
}

TEST(SensorPose, OfTwoCoilsIsExactWithoutNoise) {
  const RigidTransform T = some_pose();
  const SensorPose pose = pose_of_two_coils(some_body(), seen(T, some_body()), kSigma);
  EXPECT_LT((pose.T_em_body.matrix() - T.matrix()).norm(), 1e-11);
}

TEST(SensorPose, OfTwoCoilsWithTheirLineAlongAnAxisIsExactToo) {
  TwoCoils body = some_body();
  body[0].axis = Eigen::Vector3d::UnitX();  // the other axis alone says how they are turned about the line
  const RigidTransform T = some_pose();
  EXPECT_LT((pose_of_two_coils(body, seen(T, body), kSigma).T_em_body.matrix() - T.matrix()).norm(), 1e-11);
}

/// Weighted sum of squares that the pose has to minimise.
double cost(const RigidTransform& T, const TwoCoils& body, const TwoCoils& measured) {
  double sum = 0;
  for (std::size_t i = 0; i < body.size(); ++i) {
    sum += (measured[i].p_mm - T * body[i].p_mm).squaredNorm() / std::pow(kSigma.position_mm, 2);
    sum += (measured[i].axis - T.linear() * body[i].axis).squaredNorm() / std::pow(kSigma.angle_rad, 2);
  }
  return sum;
}

TwoCoils noisy(TwoCoils coils, std::mt19937& random) {
  for (CoilPose& coil : coils) {
    coil.p_mm += drawn(random, kSigma.position_mm);
    coil.axis = (coil.axis + drawn(random, kSigma.angle_rad)).normalized();
  }
  return coils;
}

TEST(SensorPose, OfTwoCoilsIsTheLeastSquaresOne) {
  std::mt19937 random(11);
  for (int draw = 0; draw < 20; ++draw) {
    const TwoCoils measured = noisy(seen(some_pose(), some_body()), random);
    const RigidTransform T = pose_of_two_coils(some_body(), measured, kSigma).T_em_body;
    const double least = cost(T, some_body(), measured);
    for (int part = 0; part < 6; ++part) {
      for (const double step : {-1e-4, 1e-4}) {
        PoseError away = PoseError::Zero();
        away(part) = step;
        EXPECT_GT(cost(moved_by(away, T), some_body(), measured), least) << "part " << part;
      }
    }
  }
}

TEST(SensorPose, TheCovarianceIsThatOfTheErrors) {
  std::mt19937 random(3);
  const RigidTransform T = some_pose();
  PoseCovariance found = PoseCovariance::Zero();
  PoseCovariance said = PoseCovariance::Zero();
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const SensorPose pose = pose_of_two_coils(some_body(), noisy(seen(T, some_body()), random), kSigma);
    const PoseError error = difference_of(T, pose.T_em_body);
    found += error * error.transpose() / kDraws;
    said += pose.covariance / kDraws;
  }
  for (int part = 0; part < 6; ++part) {
    EXPECT_NEAR(std::sqrt(found(part, part) / said(part, part)), 1, 0.05) << "part " << part;
  }
}

TEST(SensorPose, AMisfitIsOfDistanceAndOfAngles) {
  TwoCoils other = seen(some_pose(), some_body());
  EXPECT_LT(misfit_of(some_body(), other).distance_mm, 1e-9);
  EXPECT_LT(misfit_of(some_body(), other).angle_rad, 1e-7);
  other[1].p_mm += 3 * (other[1].p_mm - other[0].p_mm).normalized();
  EXPECT_NEAR(misfit_of(some_body(), other).distance_mm, 3, 1e-9);
  other = some_body();
  other[0].axis = rotation_by({0.1, 0, 0}) * other[0].axis;  // toward the other axis
  EXPECT_NEAR(misfit_of(some_body(), other).angle_rad, 0.1, 1e-9);
  other = some_body();
  other[0].axis = rotation_by({0, 0.1, 0}) * other[0].axis;  // toward the line, square to the other axis
  EXPECT_NEAR(misfit_of(some_body(), other).angle_rad, 0.1, 1e-9);
}

TEST(SensorPose, ATurnAboutACommonLineIsNotKnown) {
  TwoCoils coils = some_body();
  EXPECT_TRUE(knows_turn(coils));
  coils[0].axis = coils[1].axis = Eigen::Vector3d::UnitX();
  EXPECT_FALSE(knows_turn(coils)) << "axes and line are parallel";
  coils[1].axis = -coils[1].axis;
  EXPECT_FALSE(knows_turn(coils)) << "or opposite";
  coils[0].axis = coils[1].axis = Eigen::Vector3d::UnitZ();
  EXPECT_TRUE(knows_turn(coils)) << "parallel axes square to the line";
  coils[1].p_mm = coils[0].p_mm + Eigen::Vector3d(2, 0, 0);
  EXPECT_FALSE(knows_turn(coils)) << "a line of 2 mm has no direction";
  coils[1].axis = Eigen::Vector3d::UnitY();
  EXPECT_TRUE(knows_turn(coils)) << "axes that differ need no line";
}

TEST(SensorPose, ADifferenceIsUndoneByItself) {
  const RigidTransform from = some_pose();
  PoseError w_and_v;
  w_and_v << 0.2, -0.1, 0.4, 3, -2, 1;
  const RigidTransform to = moved_by(w_and_v, from);
  EXPECT_LT((difference_of(from, to) - w_and_v).norm(), 1e-12);
  EXPECT_LT(difference_of(from, from).norm(), 1e-12);
}

}  // namespace
}  // namespace tubed
