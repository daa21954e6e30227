#include "daemon/estimator/coils/loose_ends.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

using std::chrono::seconds;

constexpr double kSpacing_mm = 2;

/// At 60, 140 and 220 mm; the others are missing.
CoilObservations coils_that_are_used(std::initializer_list<std::size_t> used) {
  CoilObservations coils;
  coils.count = 3;
  for (int i = 0; i < 3; ++i) coils.coils[static_cast<std::size_t>(i)].s_mm = 60 + 80 * i;
  for (const std::size_t i : used) coils.coils[i].state = CoilState::kUsed;
  return coils;
}

double bends_away_mm(double distance_mm) {
  return std::min((distance_mm - 10) * (distance_mm - 10) / (2 * 80), distance_mm - 10);
}

class LooseEndsTest : public ::testing::Test {
 protected:
  void hear(std::initializer_list<std::size_t> used) { ends.observe(coils_that_are_used(used), now); }
  /// An image that shows the tube between these places, and has all of it in view.
  void show(double from_mm, double to_mm) {
    std::vector<CorrespondenceLine> lines(191);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const double s_mm = kSpacing_mm * static_cast<double>(i);
      lines[i].in_view = true;
      lines[i].agrees = s_mm >= from_mm && s_mm <= to_mm;
    }
    seen.record(lines, kSpacing_mm);
    ViewConstraints view;
    view.camera = &camera;
    view.seen = &seen;
    ends.observe(std::span(&view, 1), now);
  }
  [[nodiscard]] Eigen::Vector3d sigma_mm(double s_mm) const {
    return ends.square_mm2(s_mm, Eigen::Vector3d::Zero(), now).diagonal().cwiseSqrt();
  }

  Camera camera{one_view_room().cameras.front()};  // looks along z
  SeenTube seen;
  LooseEnds ends;
  MonotonicTime now = from_ns(1'000'000'000);
};

TEST_F(LooseEndsTest, BetweenCoilsNothingIsLoose) {
  EXPECT_TRUE(sigma_mm(0).isZero()) << "before the first measurement";
  hear({0, 1, 2});
  for (const double s_mm : {50.0, 60.0, 100.0, 220.0, 230.0}) EXPECT_TRUE(sigma_mm(s_mm).isZero()) << s_mm;
}

TEST_F(LooseEndsTest, BeyondThemTheTubeMayBendToAnySide) {
  hear({0, 1, 2});
  EXPECT_TRUE(sigma_mm(0).isApproxToConstant(bends_away_mm(60), 1e-9));
  EXPECT_TRUE(sigma_mm(310).isApproxToConstant(bends_away_mm(90), 1e-9));
  EXPECT_TRUE(sigma_mm(220 + 300).isApproxToConstant(300 - 10, 1e-9)) << "no further than it is long";
}

TEST_F(LooseEndsTest, ACoilThatIsMissingHoldsItsPlaceForAWhile) {
  hear({0, 1, 2});
  now += seconds(2);
  hear({0, 1});
  EXPECT_TRUE(sigma_mm(220).isApproxToConstant(2 * 3, 1e-9));
  EXPECT_TRUE(sigma_mm(310).isApproxToConstant(bends_away_mm(90) + 2 * 3, 1e-9));
  now += seconds(100);
  hear({0, 1});
  EXPECT_TRUE(sigma_mm(220).isApproxToConstant(bends_away_mm(80), 1e-9)) << "as if it had never been heard";
}

TEST_F(LooseEndsTest, AnImageHoldsThemAcrossItsRaysAsFarAsItShowsThem) {
  hear({0, 1, 2});
  show(0, 280);
  constexpr double kLast_mm = 268;  // of the next ten lines seven agree
  EXPECT_LT(sigma_mm(kLast_mm).x(), 1);
  EXPECT_NEAR(sigma_mm(kLast_mm).z(), bends_away_mm(kLast_mm - 220), 1e-9) << "along them it does not";
  const double beyond_mm = 1 + bends_away_mm(320 - kLast_mm);
  EXPECT_NEAR(sigma_mm(320).y(), 1 / std::hypot(1 / beyond_mm, 1 / bends_away_mm(100)), 1e-9);
  EXPECT_LT(sigma_mm(0).x(), 1);
  now += seconds(2);
  hear({0, 1, 2});
  EXPECT_NEAR(sigma_mm(kLast_mm).x(), 1 / std::hypot(1.0 / (1 + 2 * 3), 1 / bends_away_mm(kLast_mm - 220)),
              1e-9);
  ends.forget_images();
  EXPECT_NEAR(sigma_mm(280).x(), bends_away_mm(60), 1e-9);
}

TEST_F(LooseEndsTest, WhatIsFoundBeyondAGapMayBeSomethingElse) {
  hear({0, 1, 2});
  show(150, 280);
  EXPECT_GT(sigma_mm(0).x(), 0.7 * bends_away_mm(60))
      << "the first coil is not seen, nor is what lies before it";
  show(230, 280);
  EXPECT_GT(sigma_mm(280).x(), 0.7 * bends_away_mm(60));
}

TEST_F(LooseEndsTest, AnEndIsLostOfWhichAnImageShowsSomethingElse) {
  hear({0, 1, 2});
  show(0, 380);
  EXPECT_FALSE(ends.lost(now).tip || ends.lost(now).tail);
  show(0, 280);
  EXPECT_FALSE(ends.lost(now).tip);
  EXPECT_TRUE(ends.lost(now).tail);
  now += seconds(9);
  EXPECT_TRUE(ends.lost(now).tail) << "until another image";
  now += seconds(2);
  EXPECT_FALSE(ends.lost(now).tail) << "or for ten seconds";
  show(60, 380);
  EXPECT_TRUE(ends.lost(now).tip);
}

/// A filter whose coils are the first two, at 10 and 90 mm: 290 mm of the tube are loose.
FilterBench with_two_coils() {
  RoomDescription room = one_view_room();
  room.instruments.front().coils.resize(2);
  return FilterBench(well_registered(room));
}

double sigma_of_end_mm(const FilterBench& bench, int axis) {
  return std::sqrt(static_cast<double>(
      bench.estimate->points[bench.estimate->point_count - 1].covariance_mm2[axis == 0 ? 0 : 5]));
}

TEST(LooseEnds, WithoutImagesAFilterDoesNotKnowWhereTheFarEndIs) {
  FilterBench bench = with_two_coils();
  bench.with_images = false;
  bench.measure_times(80);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable) << "no image";
  EXPECT_GT(sigma_of_end_mm(bench, 0), bends_away_mm(290));
}

TEST(LooseEnds, WhatTheImagesShowOfThemAFilterKnows) {
  FilterBench bench = with_two_coils();
  bench.measure_times(160);
  const TubeEstimate& estimate = *bench.estimate;
  const auto at_160_mm = static_cast<std::size_t>(std::lround(160.0 / 380 * (estimate.point_count - 1)));
  EXPECT_TRUE((estimate.points[at_160_mm].held_by & kHeldByImage) != 0);
  EXPECT_LT(std::sqrt(static_cast<double>(estimate.points[at_160_mm].covariance_mm2[0])), 5);
  EXPECT_GT(std::sqrt(static_cast<double>(estimate.points[at_160_mm].covariance_mm2[5])),
            bends_away_mm(70) - 1);
}

TEST(LooseEnds, AnEndThatImagesDoNotShowIsQuestionable) {
  FilterBench bench = with_two_coils();
  bench.measure_times(160);
  ASSERT_EQ(bench.estimate->validity, Validity::kValid);
  bench.hidden = {180, 390};
  bench.measure_times(8);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kImageLostTube));
  bench.hidden = {};
  bench.measure_times(8);
  EXPECT_EQ(bench.estimate->validity, Validity::kValid);
}

TEST(LooseEnds, ATipThatImagesDoNotShowIsQuestionable) {
  RoomDescription room = one_view_room();
  auto& coils = room.instruments.front().coils;
  coils.erase(coils.begin());
  for (CoilPlacement& coil : coils) --coil.sensor;
  FilterBench bench(well_registered(room));
  bench.measure_times(160);
  ASSERT_FALSE(bench.estimate->reasons.has(Reason::kTipNotSeen));
  bench.hidden = {-1, 60};
  bench.measure_times(8);
  EXPECT_NE(bench.estimate->validity, Validity::kValid);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kTipNotSeen));
}

}  // namespace
}  // namespace tubed
