#include "drivers/laboratory/tracker/marker_registration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace tubed {
namespace {

constexpr int kDraws = 400;

RigidTransform some_place() {
  return RigidTransform(Eigen::Translation3d(20, 180, -60) *
                        Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()));
}

EmErrors field_of(double warp_mm, std::int64_t seed) {
  EmErrorSettings settings;
  settings.warp_mm = warp_mm;
  const Eigen::AlignedBox3d world_mm(Eigen::Vector3d(-100, -100, -450), Eigen::Vector3d(100, 100, 60));
  return {settings, seed, world_mm.transformed(some_place().inverse())};
}

/// Residuals of all draws, and the greatest of each.
struct Residuals {
  std::vector<double> all_mm;
  std::vector<double> max_mm;

  explicit Residuals(double warp_mm) {
    for (int seed = 0; seed < kDraws; ++seed) {
      const auto drawn = register_markers({}, some_place(), field_of(warp_mm, seed), seed).residual_mm;
      all_mm.insert(all_mm.end(), drawn.begin(), drawn.end());
      max_mm.push_back(*std::max_element(drawn.begin(), drawn.end()));
    }
  }
  [[nodiscard]] double mean_mm() const {
    return std::accumulate(all_mm.begin(), all_mm.end(), 0.0) / static_cast<double>(all_mm.size());
  }
  [[nodiscard]] double mean_square_mm2() const {
    return std::inner_product(all_mm.begin(), all_mm.end(), all_mm.begin(), 0.0) /
           static_cast<double>(all_mm.size());
  }
  [[nodiscard]] double deviation_mm() const { return std::sqrt(mean_square_mm2() - mean_mm() * mean_mm()); }
  [[nodiscard]] double share_beyond(double limit_mm) const {
    const auto beyond =
        std::count_if(max_mm.begin(), max_mm.end(), [=](double greatest) { return greatest > limit_mm; });
    return static_cast<double>(beyond) / kDraws;
  }
};

TEST(MarkerRegistration, ResidualsAreThoseOfThePaperInTheMeanOfManyDraws) {
  const Residuals drawn(0);
  // 13 of 0.77 mm in each of 400 draws: the mean's own standard deviation is 0.011 mm.
  EXPECT_NEAR(drawn.mean_mm(), 1.81, 0.05);
  EXPECT_NEAR(drawn.deviation_mm(), 0.78, 0.05);
  // Of a mean of chi-square / degrees of freedom of 400 * 33: 1.2 % of it.
  EXPECT_NEAR(drawn.mean_square_mm2(), 1.81 * 1.81 + 0.78 * 0.78, 0.05 * 3.88);
}

TEST(MarkerRegistration, TheGreatestResidualOfThePaperIsOneOfThoseDrawn) {
  // Lengths of normal vectors of mean square 3.88 mm^2 follow Maxwell's distribution with a = 1.138 mm. One
  // is beyond 3.64 mm = 3.20 a with probability 0.0166, the greatest of 13 with 1 - 0.9834^13 = 0.196;
  // beyond 3.16 mm with 1/2.
  const Residuals drawn(0);
  EXPECT_NEAR(drawn.share_beyond(3.64), 0.196, 3 * std::sqrt(0.196 * 0.804 / kDraws) + 0.02);
  EXPECT_NEAR(drawn.share_beyond(3.16), 0.5, 3 * std::sqrt(0.25 / kDraws) + 0.02);
}

TEST(MarkerRegistration, WhatAWarpedFieldLeavesIsPartOfTheResidualsAndNotBesideThem) {
  const Residuals drawn(4);
  EXPECT_NEAR(drawn.mean_mm(), 1.81, 0.08);
  EXPECT_NEAR(drawn.deviation_mm(), 0.78, 0.08);
}

TEST(MarkerRegistration, WithoutErrorsItIsTheTrueOne) {
  MarkerSettings settings;
  settings.mean_residual_mm = settings.sd_residual_mm = 0;
  const SimulatedRegistration found = register_markers(settings, some_place(), field_of(0, 1), 1);
  EXPECT_TRUE(found.T_world_em.isApprox(some_place(), 1e-9));
  EXPECT_LT(found.residual_mm.front(), 1e-9);
  EXPECT_EQ(found.found_em_mm.cols(), 13);
}

TEST(MarkerRegistration, ItsErrorAmongTheMarkersIsThatOfTheTheory) {
  // Fitzpatrick, West, Maurer 1998: target error^2 = FLE^2 / n (1 + (d1^2/f1^2 + d2^2/f2^2 + d3^2/f3^2) / 3),
  // FLE^2 = 3 sigma^2, d the target's distance from each principal axis of the markers, f the markers' RMS
  // one; 1 at their middle.
  double squares_mm2 = 0;
  const MarkerSettings settings;
  for (int seed = 0; seed < kDraws; ++seed) {
    const SimulatedRegistration found = register_markers(settings, some_place(), field_of(0, seed), seed);
    const Eigen::Vector3d middle_mm = found.found_ct_mm.rowwise().mean();
    squares_mm2 += (found.T_world_em * (some_place().inverse() * middle_mm) - middle_mm).squaredNorm();
  }
  const double sigma_mm = localisation_sigma_mm(settings, 0);
  const double expected_mm2 = 3 * sigma_mm * sigma_mm / settings.count;
  // Chi-square of 3 degrees of freedom a draw: 4 % of the mean. The middle of the found places is off itself
  // by sigma_ct, part of sigma.
  EXPECT_NEAR(squares_mm2 / kDraws, expected_mm2, 0.15 * expected_mm2);
}

TEST(MarkerRegistration, AFieldThatExplainsAllResidualsLeavesNoOtherError) {
  EXPECT_EQ(localisation_sigma_mm({}, 100), 0);
  EXPECT_NEAR(localisation_sigma_mm({}, 0), 1.237, 0.001);  // sqrt(3.8845 / (3 * 11 / 13))
}

}  // namespace
}  // namespace tubed
