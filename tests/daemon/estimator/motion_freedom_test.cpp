// How free the motion is, against closed forms.
#include "daemon/estimator/motion_freedom.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

TEST(MotionFreedom, UpdatesThatPullAsExpectedLeaveIt) {
  MotionFreedom freedom;
  for (int i = 0; i < 100; ++i) freedom.adapt(15, 15, 0.025, 0);
  EXPECT_DOUBLE_EQ(freedom.learnt(), 1);
}

// Half a second of pulls of twice what is expected doubles it, however many updates that are.
TEST(MotionFreedom, FollowsWhatUpdatesPullWithinHalfASecond) {
  for (const int updates : {5, 20}) {
    MotionFreedom freedom;
    for (int i = 0; i < updates; ++i) freedom.adapt(30, 15, 0.5 / updates, 0);
    EXPECT_NEAR(freedom.learnt(), 2, 1e-12);
  }
}

TEST(MotionFreedom, IsHeldFirmOnlyWhereThereIsNoiseToAverage) {
  MotionFreedom noisy;
  MotionFreedom distorted;
  for (int i = 0; i < 100; ++i) {
    noisy.adapt(1, 15, 0.1, 0);
    distorted.adapt(1, 15, 0.1, 1);
  }
  EXPECT_DOUBLE_EQ(noisy.learnt(), 0.4);
  EXPECT_DOUBLE_EQ(distorted.learnt(), 1);
  noisy.remember_used(noisy.learnt());
  EXPECT_DOUBLE_EQ(noisy.variance_factor(), 0.71);
  EXPECT_DOUBLE_EQ(distorted.variance_factor(), 1);
}

TEST(MotionFreedom, AJerkIsAMeasurementFarMoreSurprisingThanUsual) {
  MotionFreedom freedom;
  for (int i = 0; i < 60; ++i) EXPECT_DOUBLE_EQ(freedom.needed_for(0.5), 1);
  EXPECT_DOUBLE_EQ(freedom.needed_for(0.65), 1);
  EXPECT_DOUBLE_EQ(freedom.needed_for(0.9), 20);
  EXPECT_DOUBLE_EQ(freedom.needed_for(0), 1);             // too few coils
  EXPECT_DOUBLE_EQ(freedom.needed_for(std::nan("")), 1);  // no number
}

TEST(MotionFreedom, BeforeItIsKnownWhatIsUsualNothingIsAJerk) {
  MotionFreedom freedom;
  for (int i = 0; i < 9; ++i) freedom.needed_for(0.5);
  EXPECT_DOUBLE_EQ(freedom.needed_for(5), 1);
  freedom = MotionFreedom{};
  for (int i = 0; i < 30; ++i) freedom.needed_for(0.5);
  freedom.forget_surprises();
  EXPECT_DOUBLE_EQ(freedom.needed_for(5), 1);
}

}  // namespace
}  // namespace tubed
