// What is not known of a tip that nobody has described is in its covariance.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/daemon/estimator/tip_bench.hpp"

namespace tubed {
namespace {

constexpr double kMayBe_per_mm = 0.0559;  // a hook of 8 mm with probability 0.2, root mean square

TEST(UnknownTip, BeforeItWasLookedAtItMayBeAHookBeyondTheFirstCoil) {
  TipBench bench(kStraightTube, 10);
  bench.ask();
  EXPECT_NEAR(bench.shape->sigma_of_unknown_tip_mm(0, bench.coils), kMayBe_per_mm * 10 * 10 / 2, 0.01);
  EXPECT_NEAR(bench.shape->sigma_of_unknown_tip_mm(5, bench.coils), kMayBe_per_mm * 5 * 5 / 2, 0.01);
  EXPECT_EQ(bench.shape->sigma_of_unknown_tip_mm(10, bench.coils), 0);
}

TEST(UnknownTip, ItIsAHookNoLongerThanThoseThatAreTried) {
  TipBench bench(kStraightTube, 25);
  bench.ask();
  EXPECT_NEAR(bench.shape->sigma_of_unknown_tip_mm(0, bench.coils), kMayBe_per_mm * 14 * 14 / 2, 0.01);
  EXPECT_EQ(bench.shape->sigma_of_unknown_tip_mm(14, bench.coils), 0);
}

TEST(UnknownTip, ImagesOfAStraightOneMakeItCertain) {
  TipBench bench(kStraightTube, 10);
  for (int i = 0; i < 6; ++i) bench.ask();
  ASSERT_EQ(bench.shape->rest(), nullptr);
  EXPECT_LT(bench.shape->sigma_of_unknown_tip_mm(0, bench.coils), 1.5);
}

TEST(UnknownTip, AHookThatNobodyDescribedMayBendOtherwise) {
  TipBench bench({8, 14, 1}, 6);
  for (int i = 0; i < 8 && bench.shape->rest() == nullptr; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  EXPECT_NEAR(bench.shape->sigma_of_unknown_tip_mm(0, bench.coils), 0.04 * 6 * 6 / 2, 0.01);
  EXPECT_EQ(bench.shape->unseen_directions(), Eigen::Matrix3d::Identity());
}

TEST(UnknownTip, OneThatIsDescribedIsKnown) {
  for (const RestShape told : {RestShape::kStraight, RestShape::kHook}) {
    TipBench bench(kStraightTube, 10, told);
    bench.ask();
    EXPECT_EQ(bench.shape->sigma_of_unknown_tip_mm(0, bench.coils), 0);
  }
}

TEST(UnknownTip, ViewsLeaveItsDepthOpen) {
  TipBench bench(kStraightTube, 10);
  for (int i = 0; i < 6; ++i) bench.ask();
  bench.shape->note_view(0, bench.now, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d depth = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(bench.shape->unseen_directions(), depth * depth.transpose());
  bench.shape->note_view(1, bench.now, Eigen::Vector3d::UnitX());
  EXPECT_EQ(bench.shape->unseen_directions(), Eigen::Matrix3d::Zero());
}

}  // namespace
}  // namespace tubed
