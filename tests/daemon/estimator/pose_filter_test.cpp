#include "daemon/estimator/reference/pose_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tubed {
namespace {

constexpr double kPeriod_s = 0.025;
constexpr double kTimeConstant_s = 0.1;

MonotonicTime at(int k) { return from_ns(1'000'000'000 + k * 25'000'000LL); }

SensorPose pose_of(const PoseError& away, double sigma) {
  SensorPose pose;
  pose.T_em_body = moved_by(away, RigidTransform::Identity());
  pose.covariance = sigma * sigma * PoseCovariance::Identity();
  return pose;
}

PoseError along_x(double mm) {
  PoseError error = PoseError::Zero();
  error(3) = mm;
  return error;
}

double settled_gain() { return 1 - std::exp(-kPeriod_s / kTimeConstant_s); }

TEST(PoseFilter, WhatDoesNotMoveIsExact) {
  PoseError away;
  away << 0.3, -0.2, 0.1, 10, 20, 30;
  PoseFilter filter(kTimeConstant_s);
  filter.begin(pose_of(away, 0.1), at(0));
  for (int k = 1; k < 100; ++k) filter.update(pose_of(away, 0.1), at(k));
  EXPECT_LT(difference_of(filter.pose(), pose_of(away, 0).T_em_body).norm(), 1e-12);
}

TEST(PoseFilter, BeginsAsTheMean) {
  PoseFilter filter(1e3);
  filter.begin(pose_of(along_x(1), 0.6), at(0));
  filter.update(pose_of(along_x(2), 0.6), at(1));
  filter.update(pose_of(along_x(6), 0.6), at(2));
  EXPECT_NEAR(filter.pose().translation().x(), 3, 1e-12);
  EXPECT_NEAR(filter.covariance()(4, 4), 0.36 / 3, 1e-12);
}

TEST(PoseFilter, KeepsOfWhiteNoiseWhatTheGainSays) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 0.02);
  PoseFilter filter(kTimeConstant_s);
  filter.begin(pose_of(PoseError::Zero(), 0.02), at(0));
  PoseError variance = PoseError::Zero();
  constexpr int kCount = 20000;
  for (int k = 1; k <= kCount; ++k) {
    PoseError noise;
    for (double& part : noise) part = normal(random);
    filter.update(pose_of(noise, 0.02), at(k));
    const PoseError error = difference_of(RigidTransform::Identity(), filter.pose());
    variance += error.cwiseAbs2() / kCount;
  }
  const double k = settled_gain();
  const double factor = std::sqrt(k / (2 - k));  // 0.354
  for (int part = 0; part < 6; ++part) {
    EXPECT_NEAR(std::sqrt(variance(part)) / 0.02, factor, 0.04 * factor) << "part " << part;
    EXPECT_GE(filter.covariance()(part, part), factor * factor * 4e-4 * 0.999) << "never less is said";
  }
}

TEST(PoseFilter, FollowsAStepWithinItsTimeConstant) {
  PoseFilter filter(kTimeConstant_s);
  filter.begin(pose_of(PoseError::Zero(), 0.1), at(0));
  for (int k = 1; k <= 400; ++k) filter.update(pose_of(PoseError::Zero(), 0.1), at(k));
  for (int k = 401; k <= 404; ++k) filter.update(pose_of(along_x(3), 0.1), at(k));
  EXPECT_NEAR(filter.pose().translation().x() / 3, 1 - std::exp(-1), 1e-9) << "one time constant";
  for (int k = 405; k <= 412; ++k) filter.update(pose_of(along_x(3), 0.1), at(k));
  EXPECT_NEAR(filter.pose().translation().x() / 3, 1 - std::exp(-3), 1e-9) << "three";
}

TEST(PoseFilter, SaysHowFarItIsBehindWhatMoves) {
  constexpr double kSpeed_mm_s = 20;
  PoseFilter filter(kTimeConstant_s);
  filter.begin(pose_of(PoseError::Zero(), 1e-6), at(0));
  for (int k = 1; k <= 400; ++k) filter.update(pose_of(along_x(kSpeed_mm_s * kPeriod_s * k), 1e-6), at(k));
  const double behind_mm = kSpeed_mm_s * kPeriod_s * 400 - filter.pose().translation().x();
  const double k = settled_gain();
  EXPECT_NEAR(behind_mm, (1 - k) / k * kSpeed_mm_s * kPeriod_s, 1e-6);
  EXPECT_NEAR(std::sqrt(filter.covariance()(3, 3)), behind_mm, 1e-3);
}

TEST(PoseFilter, KnowsLessWithEachMeasurementThatIsMissing) {
  PoseFilter filter(kTimeConstant_s);
  filter.begin(pose_of(PoseError::Zero(), 0.1), at(0));
  double before = filter.covariance()(0, 0);
  const double k = settled_gain();
  for (int missed = 1; missed <= 10; ++missed) {
    filter.miss(at(missed));
    EXPECT_NEAR(filter.covariance()(0, 0) - before, k * k / (1 - k) * 0.01, 1e-12);
    before = filter.covariance()(0, 0);
  }
}

TEST(PoseFilter, WithoutATimeConstantTakesWhatWasMeasured) {
  PoseFilter filter(0);
  filter.begin(pose_of(PoseError::Zero(), 0.1), at(0));
  filter.update(pose_of(along_x(2), 0.1), at(1));
  EXPECT_NEAR(filter.pose().translation().x(), 2, 1e-12);
}

}  // namespace
}  // namespace tubed
