#include "daemon/estimator/tip/tip_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>

#include "tests/daemon/estimator/tip_bench.hpp"

namespace tubed {
namespace {

/// Coefficients of a tube that is a circle of this radius in the plane x, y, all along.
Eigen::Matrix3Xd circle_of(double radius_mm) {
  const EstimatorSettings settings;
  const UniformCubicBSpline spline(settings.coefficient_count, 380);
  Eigen::Matrix3Xd C(3, settings.coefficient_count);
  for (Eigen::Index i = 0; i < C.cols(); ++i) {
    const double turn_rad = static_cast<double>(i - 1) * spline.spacing_mm() / radius_mm;
    C.col(i) = radius_mm * Eigen::Vector3d(std::cos(turn_rad), std::sin(turn_rad), 0);
  }
  return C;
}

TEST(TipShape, AHookThatNobodyToldOfIsFound) {
  int found = 0;
  for (const double roll_rad : {0.0, 0.8, 1.6, 3.0, 4.5}) {
    TipBench bench({8, 14, roll_rad}, 6);
    for (int i = 0; i < 4; ++i) bench.ask();
    if (bench.shape->rest() == nullptr) continue;  // PreshapedEstimator: then it is doubted, or near enough
    ++found;
    EXPECT_GT(bench.shape->rest()->binormal().normalized().dot(bench.tube.binormal()), std::cos(0.4))
        << roll_rad;
  }
  EXPECT_GE(found, 3);
}

TEST(TipShape, AStraightTipStaysStraight) {
  for (const double coil_mm : {5.0, 10.0, 15.0}) {
    TipBench bench(kStraightTube, coil_mm);
    for (int i = 0; i < 6; ++i) EXPECT_FALSE(bench.ask());
    EXPECT_EQ(bench.shape->rest(), nullptr);
    EXPECT_LT(bench.shape->gain(), 5);
    EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
  }
}

constexpr HookedTube kHook{8, 14, 3};
constexpr HookedTube kTightHook{6, 14, 0};

TEST(TipShape, WhateverItsRollATightHookIsFound) {
  for (const double roll_rad : {0.0, 0.8, 1.5, 2.2, 3.0, 3.8, 4.5, 5.3}) {
    TipBench bench({6, 14, roll_rad}, 4);
    for (int i = 0; i < 4; ++i) bench.ask();
    ASSERT_NE(bench.shape->rest(), nullptr) << roll_rad;
    EXPECT_GT(bench.shape->rest()->binormal().normalized().dot(bench.tube.binormal()), std::cos(0.4))
        << roll_rad;
  }
}

TEST(TipShape, AThirdRoundThatSaysOtherwiseCountsForNothing) {
  TipBench bench(kStraightTube, 4);
  for (int i = 0; i < 3; ++i) bench.ask();  // the first two are a round
  bench.tube = kTightHook;
  bench.ask();
  EXPECT_LT(bench.shape->gain(), 8);
  EXPECT_EQ(bench.shape->rest(), nullptr);
}

// Two images a round: one that is asked all starts, and one that is asked for the best of them once more.
TEST(TipShape, OneRoundAloneDecidesNothingWhereCoilsDoNot) {
  TipBench bench(kHook, 5);
  for (int i = 0; i < 2; ++i) bench.ask();
  EXPECT_GT(bench.shape->gain(), 12);
  EXPECT_EQ(bench.shape->rest(), nullptr);
  bench.tube = kStraightTube;  // as when the instant before was led astray
  bench.ask();
  EXPECT_LT(bench.shape->gain(), 8);
  EXPECT_EQ(bench.shape->rest(), nullptr);
  bench.tube = kHook;
  for (int i = 0; i < 4; ++i) bench.ask();
  EXPECT_NE(bench.shape->rest(), nullptr);
}

// A coil inside it is turned by the whole of what is bent behind it, which no image can make.
TEST(TipShape, AHookThatACoilTellsIsTakenAfterTheFirstRound) {
  TipBench bench(kTightHook, 4);
  bench.ask(0.1);
  EXPECT_EQ(bench.shape->rest(), nullptr);
  bench.ask(0.1);
  ASSERT_NE(bench.shape->rest(), nullptr);
  EXPECT_GT(bench.shape->rest()->binormal().normalized().dot(bench.tube.binormal()), std::cos(0.4));
}

TEST(TipShape, WhatTheNextImageDoesNotSayIsForgotten) {
  TipBench bench(kTightHook, 4);
  for (int i = 0; i < 2; ++i) bench.ask(0.1);
  TipBench again(kTightHook, 4);
  again.ask(0.1);
  again.tube = kStraightTube;
  again.ask(0.1);
  EXPECT_GT(bench.shape->gain(), 25);
  EXPECT_LT(again.shape->gain(), 8);
}

TEST(TipShape, WhereBothEndAtTheSamePlaceNothingIsDoubted) {
  TipBench bench({20, 40, 1.5}, 10);
  for (int i = 0; i < 4; ++i) bench.ask();
  EXPECT_GT(bench.shape->gain(), 8);
  EXPECT_EQ(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
}

TEST(TipShape, ATipThatNoCoilSeesIsDoubtedForLess) {
  TipBench bench({30, 40, 1.5}, 15);
  for (int i = 0; i < 6; ++i) bench.ask();
  EXPECT_GT(bench.shape->gain(), 0);
  EXPECT_LT(bench.shape->gain(), 8);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kUndecided);
}

TEST(TipShape, UntilTheFirstRoundIsOverATipBeyondTheCoilsIsDoubted) {
  TipBench bench(kStraightTube, 15);
  bench.ask(0.1);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kUndecided);
  TipBench held(kStraightTube, 8);
  held.ask(0.1);
  EXPECT_EQ(held.shape->doubt(held.coils), TipDoubt::kNone);
  for (int i = 0; i < 8; ++i) bench.ask(0.1);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
}

TEST(TipShape, AHookThatIsGoneIsDropped) {
  TipBench bench(kHook, 6);
  for (int i = 0; i < 4; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  bench.tube = kStraightTube;
  for (int i = 0; i < 30; ++i) bench.ask(2.1);
  EXPECT_EQ(bench.shape->rest(), nullptr);
}

// While it is in doubt it is asked for as often as at a beginning.
TEST(TipShape, AHookThatIsGoneIsDroppedWithinSeconds) {
  TipBench bench(kHook, 6);
  for (int i = 0; i < 4; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  bench.tube = kStraightTube;
  int images = 0;
  while (bench.shape->rest() != nullptr && images < 40) bench.ask(), ++images;
  EXPECT_LT(0.6 * images, 10) << "seconds";
}

// A straight tip that was taken for a hook may keep a small gain for long: what bends it lasts.
TEST(TipShape, AHookIsDroppedWhileItIsStillALittleTheBetter) {
  TipBench bench(kHook, 6);
  for (int i = 0; i < 4; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  bench.tube = kStraightTube;
  for (int i = 0; i < 40 && bench.shape->rest() != nullptr; ++i) bench.ask();
  ASSERT_EQ(bench.shape->rest(), nullptr);
  EXPECT_GT(bench.shape->gain(), 0);
}

TEST(TipShape, TwoSidesAreTenDegreesApartAndOfTheSameSecond) {
  TipBench bench({8, 14, 1}, 15, RestShape::kHook);
  for (int i = 0; i < 4; ++i) bench.ask();
  ASSERT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kOneView);
  const auto looking = [](double deg) {
    const double rad = deg * M_PI / 180;
    return Eigen::Vector3d(std::sin(rad), 0, std::cos(rad));
  };
  const auto doubt_with = [&](double deg, double ago_s) {
    bench.shape->note_view(1, bench.now - std::chrono::milliseconds(static_cast<int>(1000 * ago_s)),
                           looking(deg));
    bench.shape->note_view(0, bench.now, looking(0));
    return bench.shape->doubt(bench.coils);
  };
  EXPECT_EQ(doubt_with(5, 0), TipDoubt::kOneView);
  EXPECT_EQ(doubt_with(15, 0), TipDoubt::kNone);
  EXPECT_EQ(doubt_with(15, 1), TipDoubt::kNone);
  EXPECT_EQ(doubt_with(15, 3), TipDoubt::kOneView);
}

TEST(TipShape, TwoSidesAreOfTheSameSecondAlsoWhileNoImageShowsTheTip) {
  TipBench bench(kHook, 15, RestShape::kHook);
  for (int i = 0; i < 4; ++i) bench.ask();
  bench.shape->note_view(0, bench.now, Eigen::Vector3d::UnitZ());
  bench.shape->note_view(1, bench.now, Eigen::Vector3d::UnitX());
  ASSERT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
  bench.ask(2);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kOneView);
}

TEST(TipShape, OneViewOfAHookWithoutACoilInItIsDoubted) {
  TipBench bench({8, 14, 1}, 15, RestShape::kHook);
  for (int i = 0; i < 4; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kOneView);
}

TEST(TipShape, AHookThatIsConfiguredAndNotThereIsTold) {
  TipBench bench(kStraightTube, 8, RestShape::kHook);
  ASSERT_NE(bench.shape->rest(), nullptr);
  for (int i = 0; i < 4; ++i) bench.ask();
  EXPECT_EQ(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNoSuchHook);
  std::array<char, 256> words{};
  write_tip_doubt(bench.shape->doubt(bench.coils), bench.room.instruments.front(), words);
  EXPECT_NE(std::string(words.data()).find("hook is configured"), std::string::npos) << words.data();
}

TEST(TipShape, AHookWhereAStraightTipIsConfiguredIsToldAndNotTaken) {
  TipBench bench(kTightHook, 4, RestShape::kStraight);
  for (int i = 0; i < 3; ++i) bench.ask();
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);  // too early to say
  bench.ask();
  EXPECT_EQ(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNotStraight);
  std::array<char, 256> words{};
  write_tip_doubt(bench.shape->doubt(bench.coils), bench.room.instruments.front(), words);
  EXPECT_NE(std::string(words.data()).find("a straight one is configured"), std::string::npos)
      << words.data();

  TipBench straight(kStraightTube, 8, RestShape::kStraight);
  for (int i = 0; i < 6; ++i) straight.ask();
  EXPECT_EQ(straight.shape->doubt(straight.coils), TipDoubt::kNone);
}

TEST(TipShape, AHookThatIsFarMoreBentThanItIsMadeIsTold) {
  TipBench bench({40, 60, 1}, 4, RestShape::kHook);
  InstrumentDescription& instrument = bench.room.instruments.front();
  instrument.hook_radius_mm = 40;
  instrument.hook_length_mm = 60;
  bench.shape = std::make_unique<TipShape>(EstimatorSettings{}, instrument, bench.room);
  for (int i = 0; i < 4; ++i) bench.ask();
  bench.shape->rest()->set_binormal(Eigen::Vector3d::UnitZ());
  bench.shape->note_shape(circle_of(12));
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kBentFurther);
  bench.shape->note_shape(circle_of(35));
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
}

TEST(TipShape, OfAHookThatNobodyDescribedTwoViewsDoNotTellHowFarItBends) {
  TipBench bench(kTightHook, 10);
  for (int i = 0; i < 8 && bench.shape->rest() == nullptr; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  bench.shape->note_view(0, bench.now, Eigen::Vector3d::UnitZ());
  bench.shape->note_view(1, bench.now, Eigen::Vector3d::UnitX());
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kUndecided);
}

TEST(TipShape, SigmaOfAHookThatNoCoilHoldsGrowsTowardItsEnd) {
  TipBench bench({8, 14, 1}, 15, RestShape::kHook);
  bench.ask();
  // 15 % of 14^2 / (2 x 8) mm.
  EXPECT_NEAR(bench.shape->sigma_of_making_mm(0, bench.coils), 1.84, 0.01);
  EXPECT_NEAR(bench.shape->sigma_of_making_mm(7, bench.coils), 0.46, 0.01);
  EXPECT_EQ(bench.shape->sigma_of_making_mm(14, bench.coils), 0);
  TipBench held({8, 14, 1}, 6, RestShape::kHook);
  held.ask();
  EXPECT_EQ(held.shape->sigma_of_making_mm(0, held.coils), 0);
}

TEST(TipShape, ItIsAskedNowAndThen) {
  TipBench bench(kStraightTube);
  for (int i = 0; i < 2; ++i) bench.ask(0.1);  // a round
  const double gain = bench.shape->gain();
  bench.ask(0.1);
  EXPECT_EQ(bench.shape->gain(), gain);
  bench.ask(0.5);
  EXPECT_NE(bench.shape->gain(), gain);
  bench.shape->reset();
  EXPECT_EQ(bench.shape->gain(), 0);
}

}  // namespace
}  // namespace tubed
