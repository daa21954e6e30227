// A coil that moves away from the others from one measurement to the next, and stays there.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

constexpr int kSecond = 40;  // measurements
constexpr int kNoticed = 4;  // of them, with noise of 4 mm

void measure_displaced(FilterBench& bench, int count) {
  for (int i = 0; i < count; ++i) {
    bench.measure(0, 2);
  }
}

/// Two seconds of right coils, then so many measurements with the middle one off by so much in z.
FilterBench with_displaced_coil(double off_mm, int count) {
  FilterBench bench;
  bench.outlier_mm = off_mm;
  bench.measure_times(2 * kSecond);
  measure_displaced(bench, count);
  return bench;
}

// By so little that the shape without it, which is known ever worse there, would soon agree with it.
TEST(DisplacedCoil, ACoilThatJumpedStaysOutForAsLongAsItIsThere) {
  for (const bool with_images : {true, false}) {
    for (const double outlier_mm : {12.0, -15.0, 20.0}) {
      FilterBench bench;
      bench.with_images = with_images;
      bench.outlier_mm = outlier_mm;
      bench.measure_times(2 * kSecond);
      int used = 0;
      int doubtless = 0;
      double max_mm = 0;
      for (int i = 0; i < 12 * kSecond; ++i) {
        bench.measure(0, 2);
        max_mm = std::max(max_mm, bench.rms_mm());
        if (i < kNoticed) continue;
        used += bench.estimate->coils[2].state == CoilState::kUsed ? 1 : 0;
        doubtless += bench.estimate->validity == Validity::kQuestionable ? 0 : 1;
      }
      EXPECT_EQ(used, 0) << outlier_mm << " mm" << (with_images ? ", images" : "");
      EXPECT_EQ(doubtless, 0) << outlier_mm << " mm" << (with_images ? ", images" : "");
      EXPECT_LT(max_mm, 3) << outlier_mm << " mm" << (with_images ? ", images" : "");
    }
  }
}

TEST(DisplacedCoil, ACoilThatJumpsBackIsHeardAtOnce) {
  FilterBench bench = with_displaced_coil(12, 6 * kSecond);
  ASSERT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier);
  bench.measure_times(4);
  EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kUsed);
}

TEST(DisplacedCoil, ACoilThatComesBackSlowlyIsHeardAgain) {
  FilterBench bench = with_displaced_coil(12, kSecond);
  for (; bench.outlier_mm > 0; bench.outlier_mm -= 0.5) {
    bench.measure(0, 2);
  }
  EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kUsed);
}

/// Standard deviations of the point at that arc length, an axis.
Eigen::Vector3d sigma_mm(const TubeEstimate& estimate, double s_mm) {
  const double point = s_mm / static_cast<double>(estimate.length_mm) * (kMaxCentrelinePoints - 1);
  const auto& upper = estimate.points[static_cast<std::size_t>(std::lround(point))].covariance_mm2;
  return Eigen::Vector3f(upper[0], upper[3], upper[5]).cwiseSqrt().cast<double>();
}

// The shaft's end may whip: the shape follows it. But it may be the coil.
TEST(DisplacedCoil, WhereTheLastCoilHasJumpedAndIsBelievedAgainSigmaHasItsJump) {
  FilterBench bench;
  bench.outlier_mm = 15;
  bench.measure_times(2 * kSecond);
  const double before_mm = sigma_mm(*bench.estimate, 370).z();
  const double far_mm = sigma_mm(*bench.estimate, 100).z();
  for (int i = 0; i < 8 * kSecond; ++i) bench.measure(0, 4);
  ASSERT_EQ(bench.estimate->coils[4].state, CoilState::kUsed);
  EXPECT_GT(sigma_mm(*bench.estimate, 370).z(), before_mm + 4);
  EXPECT_LT(sigma_mm(*bench.estimate, 100).z(), far_mm + 1);
  bench.measure_times(8 * kSecond);
  ASSERT_EQ(bench.estimate->coils[4].state, CoilState::kUsed);
  EXPECT_LT(sigma_mm(*bench.estimate, 370).z(), before_mm + 1) << "it has jumped back";
}

// While it is out something hides the tube, and the estimator begins again.
TEST(DisplacedCoil, NothingIsBegunWithIt) {
  FilterBench bench = with_displaced_coil(12, 2 * kSecond);
  bench.image_off_mm = 60;
  measure_displaced(bench, 2 * kSecond);
  bench.image_off_mm = 0;
  int used = 0;
  for (int i = 0; i < 4 * kSecond; ++i) {
    bench.measure(0, 2);
    used += bench.estimate->coils[2].state == CoilState::kUsed ? 1 : 0;
  }
  EXPECT_EQ(used, 0);
}

}  // namespace
}  // namespace tubed
