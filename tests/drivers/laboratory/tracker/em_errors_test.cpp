#include "drivers/laboratory/tracker/em_errors.hpp"
#include "idl/geometry/degree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace tubed {
namespace {

const Eigen::AlignedBox3d kVolume(Eigen::Vector3d::Constant(-150), Eigen::Vector3d::Constant(150));
const Eigen::Vector3d kPlace_mm(20, -30, 90);
const Eigen::Vector3d kTangent(0.6, 0, 0.8);

CoilSample measured(const EmErrors& errors, int sensor, std::int64_t k, double t_s = 0) {
  return errors.measure(sensor, k, t_s, kPlace_mm, kTangent);
}

double angle_to(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

EmErrorSettings paper_noise() {
  EmErrorSettings settings;
  settings.lambda_mm = 4;
  settings.psi_rad = 3 * kDegree;
  return settings;
}

TEST(EmErrors, ThePapersNoiseIsExactlyLambdaAnd231MmAnAxisAndNeverRepeats) {
  const EmErrors errors(paper_noise(), 9, kVolume);
  constexpr int kDraws = 20'000;
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Eigen::Vector3d noise_mm = measured(errors, 2, k).p_em_mm - kPlace_mm;
    ASSERT_NEAR(noise_mm.norm(), 4, 1e-12);
    squares += noise_mm.array().square();
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(squares[axis] / kDraws), 4 / std::sqrt(3.0), 0.04);  // 2.31 mm
  }
  EXPECT_NE(measured(errors, 2, 1).p_em_mm, measured(errors, 2, 2).p_em_mm);
  EXPECT_NE(measured(errors, 2, 1).p_em_mm, measured(errors, 3, 1).p_em_mm);
}

TEST(EmErrors, TheTangentsAngleFollowsFromTheAxisOfEquation20) {
  // t turned by psi about a: 2 sin(angle / 2) = 2 sin(psi / 2) sqrt(1 - (a t)^2). Along z, a_z = cos phi with
  // phi uniform in [0, 2 pi]: sqrt(1 - a_z^2) = |sin phi|, whose distribution is F(x) = 2 / pi asin(x).
  const EmErrors errors(paper_noise(), 4, kVolume);
  constexpr int kDraws = 20'000;
  std::vector<double> shares;
  for (int k = 0; k < kDraws; ++k) {
    const CoilSample sample = errors.measure(1, k, 0, kPlace_mm, Eigen::Vector3d::UnitZ());
    const double angle = angle_to(sample.tangent_em, Eigen::Vector3d::UnitZ());
    shares.push_back(std::sin(angle / 2) / std::sin(1.5 * kDegree));
  }
  std::sort(shares.begin(), shares.end());
  for (const double share : {0.1, 0.25, 0.5, 0.75, 0.9}) {
    const double quantile = std::sin(share * std::numbers::pi / 2);
    EXPECT_NEAR(shares[static_cast<std::size_t>(share * kDraws)], quantile, 0.02) << share;
  }
}

TEST(EmErrors, FrozenNoiseIsThatOfTheCoilForEver) {
  EmErrorSettings settings = paper_noise();
  settings.draw = NoiseDraw::kOncePerCoil;
  const EmErrors errors(settings, 1, kVolume);
  EXPECT_EQ(measured(errors, 1, 5).p_em_mm, measured(errors, 1, 99).p_em_mm);
  EXPECT_EQ(measured(errors, 1, 5).tangent_em, measured(errors, 1, 99).tangent_em);
  EXPECT_NE(measured(errors, 1, 5).p_em_mm, measured(errors, 2, 5).p_em_mm);
  EXPECT_NEAR((measured(errors, 1, 5).p_em_mm - kPlace_mm).norm(), 4, 1e-12);
}

TEST(EmErrors, TheWarpReachesItsGreatestStaysInPlaceAndIsSmooth) {
  EmErrorSettings settings;
  settings.warp_mm = 4;
  settings.warp_rad = 3 * kDegree;
  const EmErrors errors(settings, 7, kVolume);
  double max_mm = 0;
  double max_change = 0;
  for (int i = 0; i < 21 * 21 * 21; ++i) {
    const Eigen::Vector3d p_mm = 15 * Eigen::Vector3d(i % 21 - 10, i / 21 % 21 - 10, i / 441 - 10);
    max_mm = std::max(max_mm, errors.warp_mm(p_mm).norm());
    const Eigen::Vector3d beside_mm = p_mm + Eigen::Vector3d(1, 0, 0);
    max_change = std::max(max_change, (errors.warp_mm(beside_mm) - errors.warp_mm(p_mm)).norm());
  }
  EXPECT_NEAR(max_mm, 4, 0.15);
  EXPECT_LT(max_change, 0.15) << "mm a mm";
  EXPECT_EQ(measured(errors, 1, 0).p_em_mm, measured(errors, 5, 777).p_em_mm);
  EXPECT_NEAR((measured(errors, 1, 0).p_em_mm - kPlace_mm - errors.warp_mm(kPlace_mm)).norm(), 0, 1e-12);
  EXPECT_LE(angle_to(measured(errors, 1, 0).tangent_em, kTangent), 3.05 * kDegree);
}

TEST(EmErrors, JitterHasTheRootMeanSquareItIsGiven) {
  EmErrorSettings settings;
  settings.jitter_mm = 0.5;
  settings.jitter_rad = 0.2 * kDegree;
  const EmErrors errors(settings, 3, kVolume);
  double squares_mm2 = 0;
  double squares_rad2 = 0;
  constexpr int kDraws = 20'000;
  for (int k = 0; k < kDraws; ++k) {
    const CoilSample sample = measured(errors, 1, k);
    squares_mm2 += (sample.p_em_mm - kPlace_mm).squaredNorm();
    squares_rad2 += std::pow(angle_to(sample.tangent_em, kTangent), 2);
  }
  EXPECT_NEAR(std::sqrt(squares_mm2 / kDraws), 0.5, 0.01);
  EXPECT_NEAR(std::sqrt(squares_rad2 / kDraws), 0.2 * kDegree, 0.005 * kDegree);
}

TEST(EmErrors, MetalPushesACoilAwayAndLeavesAgain) {
  EmErrorSettings settings;
  settings.metal = {{6, 0, 50, kPlace_mm - Eigen::Vector3d(50, 0, 0), Eigen::Vector3d(0, 100, 0), 10, 20}};
  const EmErrors errors(settings, 3, kVolume);
  // Half of 6 mm at its reach, straight away from it.
  EXPECT_LT((measured(errors, 1, 0, 10).p_em_mm - kPlace_mm - Eigen::Vector3d(3, 0, 0)).norm(), 1e-9);
  EXPECT_LT((measured(errors, 1, 0, 19).p_em_mm - kPlace_mm).norm(), 0.01) << "900 mm away";
  EXPECT_EQ(measured(errors, 1, 0, 5).p_em_mm, kPlace_mm);
  EXPECT_EQ(measured(errors, 1, 0, 20).p_em_mm, kPlace_mm);
}

TEST(EmErrors, EventsBefallTheirCoilInTheirTime) {
  EmErrorSettings settings;
  settings.events = {{EmEventKind::kDropOut, 1, 1, 2, 0},
                     {EmEventKind::kOutOfVolume, 2, 1, 2, 0},
                     {EmEventKind::kOutlier, 3, 1, 2, 25},
                     {EmEventKind::kStuck, 0, 5, 6, 0}};
  const EmErrors errors(settings, 3, kVolume);
  EXPECT_EQ(measured(errors, 1, 0, 0.99).status, CoilStatus::kOk);
  EXPECT_EQ(measured(errors, 1, 0, 1).status, CoilStatus::kMissing);
  EXPECT_TRUE(measured(errors, 1, 0, 1).p_em_mm.array().isNaN().all());
  EXPECT_EQ(measured(errors, 2, 0, 1.5).status, CoilStatus::kOutOfVolume);
  EXPECT_EQ(measured(errors, 3, 0, 1.5).status, CoilStatus::kOk);
  EXPECT_NEAR((measured(errors, 3, 0, 1.5).p_em_mm - kPlace_mm).norm(), 25, 1e-9);
  EXPECT_EQ(measured(errors, 3, 0, 2).p_em_mm, kPlace_mm);
  EXPECT_EQ(errors.stuck_since_s(4, 5.5), 5.0);
  EXPECT_FALSE(errors.stuck_since_s(4, 6).has_value());
}

TEST(EmErrors, SomeSamplesAreMissingAndBeyondTheVolumeAllAreOut) {
  EmErrorSettings settings;
  settings.drop_out_share = 0.1;
  settings.volume_em_mm = {Eigen::Vector3d::Constant(-80), Eigen::Vector3d::Constant(80)};
  const EmErrors errors(settings, 3, kVolume);
  int missing = 0;
  for (int k = 0; k < 10'000; ++k) {
    const CoilSample sample = errors.measure(1, k, 0, {0, 0, 79}, kTangent);
    missing += sample.status == CoilStatus::kMissing ? 1 : 0;
  }
  EXPECT_NEAR(missing, 1000, 150);
  settings.drop_out_share = 0;
  EXPECT_EQ(measured(EmErrors(settings, 3, kVolume), 1, 0).status, CoilStatus::kOutOfVolume);
}

}  // namespace
}  // namespace tubed
