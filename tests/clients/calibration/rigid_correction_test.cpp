// A shift and a turn from where images have the tube beside coils, against what was put in.
#include "clients/calibration/rigid_correction.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "idl/geometry/degree.hpp"

namespace tubed {
namespace {

constexpr int kImages = 60;
constexpr int kCoils = 5;

/// What coils on an arc are off by, and how images show it.
struct Bench {
  Eigen::Vector3d turn_rad{0.02, -0.015, 0.01};
  Eigen::Vector3d shift_mm{3, -2, 4};
  double local_mm = 0.5;
  double noise_mm = 0.2;
  double swing_deg = 30;  ///< of the views, to either side of the z axis
  double outliers = 0;    ///< share

  /// On a curve that does not slide in itself, as a circle or a helix does.
  [[nodiscard]] static Eigen::Vector3d curve(double s) {
    return {80 * std::cos(s) + 30 * s, 50 * std::sin(1.7 * s), 40 * std::sin(s)};
  }
  [[nodiscard]] static Eigen::Vector3d place(int coil) { return curve(0.8 * coil); }
  [[nodiscard]] static Eigen::Vector3d tangent(int coil) {
    return (curve(0.8 * coil + 1e-4) - curve(0.8 * coil - 1e-4)).normalized();
  }
  [[nodiscard]] static Eigen::Vector3d centre() {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int coil = 0; coil < kCoils; ++coil) sum += place(coil) / kCoils;
    return sum;
  }

  [[nodiscard]] std::vector<SeenBesideCoil> see(unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const auto drawn = [&] {
      const double x = normal(random);
      const double y = normal(random);
      return Eigen::Vector3d(x, y, normal(random));
    };
    std::vector<Eigen::Vector3d> own;
    for (int coil = 0; coil < kCoils; ++coil) own.push_back(local_mm * drawn());
    std::vector<SeenBesideCoil> seen;
    for (int image = 0; image < kImages; ++image) {
      const double view_rad = swing_deg * kDegree * (2.0 * image / (kImages - 1) - 1);
      const Eigen::Vector3d ray(std::sin(view_rad), 0, std::cos(view_rad));
      for (int coil = 0; coil < kCoils; ++coil) {
        SeenBesideCoil one;
        one.coil = static_cast<std::size_t>(coil);
        one.p_world_mm = place(coil);
        one.side_world = ray.cross(tangent(coil)).normalized();
        const Eigen::Vector3d off_mm = shift_mm + turn_rad.cross(place(coil) - centre()) + own[one.coil];
        const double strange_mm = uniform(random) < outliers ? 12 : 0;
        one.off_mm = one.side_world.dot(off_mm) + noise_mm * normal(random) + strange_mm;
        seen.push_back(one);
      }
    }
    return seen;
  }
  [[nodiscard]] Eigen::Matrix<double, 6, 1> truth() const {
    Eigen::Matrix<double, 6, 1> truth;
    truth << turn_rad, shift_mm;
    return truth;
  }
};

Eigen::Matrix<double, 6, 1> motion_of(const RigidCorrection& found) {
  Eigen::Matrix<double, 6, 1> motion;
  motion << found.turn_rad, found.shift_mm;
  return motion;
}

TEST(RigidCorrection, OfViewsFromTwoDirectionsIsWhatWasPutIn) {
  Bench bench;
  bench.local_mm = 0;
  const auto found = find_rigid_correction(bench.see(1));
  ASSERT_TRUE(found);
  EXPECT_LT((found->shift_mm - bench.shift_mm).norm(), 0.3);
  EXPECT_LT((found->turn_rad - bench.turn_rad).norm(), 0.3 * kDegree);
  EXPECT_LT((found->centre_world_mm - Bench::centre()).norm(), 1e-9);
  EXPECT_GT(found->rms_before_mm, 2);
  EXPECT_LT(found->rms_after_mm, 0.3);
}

// Of the squared errors in units of their covariance the mean is 6; over 200 draws its standard deviation is
// sqrt(12 / 200) = 0.25, were the size of what is local known.
TEST(RigidCorrection, CovarianceHoldsWhatEachCoilIsOffByItself) {
  double sum = 0;
  constexpr int kDraws = 200;
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    const Bench bench;
    const auto found = find_rigid_correction(bench.see(seed));
    ASSERT_TRUE(found);
    const Eigen::Matrix<double, 6, 1> error = motion_of(*found) - bench.truth();
    sum += error.dot(found->covariance.inverse() * error);
  }
  EXPECT_GT(sum / kDraws, 3);
  EXPECT_LT(sum / kDraws, 10);
}

TEST(RigidCorrection, AlongTheRaysOfOneDirectionNothingIsKnown) {
  Bench bench;
  bench.swing_deg = 0;
  const auto found = find_rigid_correction(bench.see(1));
  ASSERT_TRUE(found);
  EXPECT_GT(found->worst_shift_mm(), 10);
  EXPECT_GT(std::abs(found->worst_direction().z()), 0.9);
  bench.swing_deg = 30;
  EXPECT_LT(find_rigid_correction(bench.see(1))->worst_shift_mm(), 1);
}

TEST(RigidCorrection, WhatContradictsTheRestIsLeftOut) {
  Bench bench;
  bench.local_mm = 0.1;
  bench.outliers = 0.1;
  const auto found = find_rigid_correction(bench.see(3));
  ASSERT_TRUE(found);
  EXPECT_GT(found->left_out, 10U);
  EXPECT_LT((found->shift_mm - bench.shift_mm).norm(), 0.5);
}

TEST(RigidCorrection, OfTooFewSightingsOrCoilsNothingIsSaid) {
  std::vector<SeenBesideCoil> seen = Bench().see(1);
  std::vector<SeenBesideCoil> of_two_coils;
  for (const SeenBesideCoil& one : seen) {
    if (one.coil < 2) of_two_coils.push_back(one);
  }
  EXPECT_FALSE(find_rigid_correction(of_two_coils));
  seen.resize(kMinSightings - 1);
  EXPECT_FALSE(find_rigid_correction(seen));
}

}  // namespace
}  // namespace tubed
