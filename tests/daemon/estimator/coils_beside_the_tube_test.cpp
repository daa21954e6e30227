// All coils of a recursive estimator say that the tube lies elsewhere, along the rays of a view.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

RoomDescription with_a_side_view() {
  RoomDescription room = one_view_room();
  room.cameras.push_back(room.cameras[0]);
  room.cameras[1].name = "B";
  room.cameras[1].T_camera_world.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  return room;
}

std::string words_of_jump(const FilterBench& bench) {
  std::array<char, 256> words{};
  return bench.estimator->describe_jump(words) ? words.data() : "";
}

double sigma_in_depth_mm(const TubeEstimate& estimate) {
  return std::sqrt(static_cast<double>(estimate.points[estimate.point_count / 2].covariance_mm2[5]));
}

// The field has changed, or the patient was moved: along the rays of a view, which shows the tube as before.
TEST(CoilsBesideTheTube, WhereAllCoilsJumpAlongTheRaysTheJumpIsInSigma) {
  for (const bool with_images : {true, false}) {
    FilterBench bench;
    bench.with_images = with_images;
    bench.measure_times(80);
    const double before_mm = sigma_in_depth_mm(*bench.estimate);
    for (int i = 0; i < 40; ++i) {
      bench.measure(30);
      ASSERT_GT(sigma_in_depth_mm(*bench.estimate), before_mm + 0.4 * 30) << with_images << ", " << i;
    }
    EXPECT_NE(words_of_jump(bench).find("cath-1: all coils have jumped by "), std::string::npos);
    for (int i = 0; i < 80; ++i) bench.measure();
    EXPECT_LT(sigma_in_depth_mm(*bench.estimate), before_mm + 1) << "they have jumped back";
    EXPECT_EQ(words_of_jump(bench), "");
  }
}

// A view shows any shape that lies along its rays, and what the other one shows does not count for less.
TEST(CoilsBesideTheTube, WhatOneViewContradictsTheOtherOneDoesNotMakeGood) {
  FilterBench bench(with_a_side_view());
  bench.measure_times(80);
  ASSERT_EQ(bench.estimate->validity, Validity::kValid);
  bench.measure_shifted_times(12, 80);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kImageLostTube));
  bench.with_further_views = false;
  bench.measure_shifted_times(12, 4 * 40);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kImageLostTube)) << "4 s after its last image";
  bench.measure_shifted_times(12, 8 * 40);
  EXPECT_FALSE(bench.estimate->reasons.has(Reason::kImageLostTube)) << "12 s after its last image";
}

}  // namespace
}  // namespace tubed
