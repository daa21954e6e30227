#include "drivers/aurora/frame_counter.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

TEST(FrameCounter, CountsOneMeasurementEveryEightCounts) {
  FrameCounter counter;
  EXPECT_EQ(counter.observe(800).kind, FrameKind::kFirst);
  for (std::uint32_t k = 1; k < 100; ++k) {
    const FrameStep step = counter.observe(800 + 8 * k);
    ASSERT_EQ(step.kind, FrameKind::kNew);
    ASSERT_EQ(step.measurement, k);
    ASSERT_EQ(step.missed, 0U);
  }
  EXPECT_EQ(counter.odd_steps(), 0U);
}

TEST(FrameCounter, KnowsAMeasurementThatItHasSeen) {
  FrameCounter counter;
  counter.observe(8);
  counter.observe(16);
  const FrameStep again = counter.observe(16);
  EXPECT_EQ(again.kind, FrameKind::kDuplicate);
  EXPECT_EQ(again.measurement, 1U);
}

TEST(FrameCounter, CountsWhatNobodySaw) {
  FrameCounter counter;
  counter.observe(8);
  const FrameStep step = counter.observe(8 + 5 * 8);
  EXPECT_EQ(step.kind, FrameKind::kNew);
  EXPECT_EQ(step.measurement, 5U);
  EXPECT_EQ(step.missed, 4U);
}

TEST(FrameCounter, GoesOnThroughTheWrap) {
  FrameCounter counter;
  counter.observe(0xFFFF'FFF8);
  const FrameStep step = counter.observe(0x0000'0008);
  EXPECT_EQ(step.kind, FrameKind::kNew);
  EXPECT_EQ(step.measurement, 2U);
  EXPECT_EQ(step.missed, 1U);
}

TEST(FrameCounter, DoesNotTakeALateReplyForANewMeasurement) {
  FrameCounter counter;
  counter.observe(80);
  counter.observe(88);
  EXPECT_EQ(counter.observe(80).kind, FrameKind::kOld);
  EXPECT_EQ(counter.observe(80).kind, FrameKind::kOld);
  const FrameStep next = counter.observe(96);
  EXPECT_EQ(next.kind, FrameKind::kNew);
  EXPECT_EQ(next.missed, 0U);
}

TEST(FrameCounter, FollowsATrackerThatCountsAnew) {
  FrameCounter counter;
  counter.observe(80'000);
  EXPECT_EQ(counter.observe(8).kind, FrameKind::kOld);
  const FrameStep second = counter.observe(16);
  EXPECT_EQ(second.kind, FrameKind::kRestarted);
  EXPECT_EQ(second.measurement, 1U);
  EXPECT_EQ(counter.observe(24).kind, FrameKind::kNew);
}

TEST(FrameCounter, RoundsAStepThatIsNoMultipleOfEightAndSaysSo) {
  FrameCounter counter;
  counter.observe(80);
  EXPECT_EQ(counter.observe(83).measurement, 1U);
  EXPECT_EQ(counter.observe(83 + 13).measurement, 3U);
  EXPECT_EQ(counter.odd_steps(), 2U);
}

TEST(FrameCounter, ForgetsEverythingWhenReset) {
  FrameCounter counter;
  counter.observe(80);
  counter.reset();
  EXPECT_EQ(counter.observe(8).kind, FrameKind::kFirst);
}

}  // namespace
}  // namespace tubed::aurora
