#include "drivers/aurora/pose_guard.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;

EmFrame frame_at(double x_mm, milliseconds time) {
  EmFrame frame;
  frame.measured = MonotonicTime(time);
  frame.coil_count = 1;
  frame.coils[0].status = CoilStatus::kOk;
  frame.coils[0].p_em_mm = {x_mm, 0, -200};
  frame.coils[0].tangent_em = {0, 0, 1};
  return frame;
}

TEST(PoseGuard, BelievesACoilThatIsPushed) {
  PoseGuard guard;
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(guard.believe(frame_at(12.0 * i, milliseconds(1000 + 25 * i))));
  }
}

TEST(PoseGuard, RefusesALeapThatTheNextMeasurementDoesNotConfirm) {
  PoseGuard guard;
  EXPECT_TRUE(guard.believe(frame_at(0, milliseconds(1000))));
  EXPECT_FALSE(guard.believe(frame_at(300, milliseconds(1025))));
  EXPECT_TRUE(guard.believe(frame_at(1, milliseconds(1050))));
}

TEST(PoseGuard, BelievesALeapThatTheNextMeasurementConfirms) {
  PoseGuard guard;
  EXPECT_TRUE(guard.believe(frame_at(0, milliseconds(1000))));
  EXPECT_FALSE(guard.believe(frame_at(300, milliseconds(1025))));
  EXPECT_TRUE(guard.believe(frame_at(302, milliseconds(1050))));
}

TEST(PoseGuard, RefusesAnAxisThatTurnsRound) {
  PoseGuard guard;
  EXPECT_TRUE(guard.believe(frame_at(0, milliseconds(1000))));
  EmFrame turned = frame_at(0, milliseconds(1025));
  turned.coils[0].tangent_em = {0, 0, -1};
  EXPECT_FALSE(guard.believe(turned));
}

TEST(PoseGuard, BelievesACoilThatWasAwayForALongTime) {
  PoseGuard guard;
  EXPECT_TRUE(guard.believe(frame_at(0, milliseconds(1000))));
  EXPECT_TRUE(guard.believe(frame_at(400, milliseconds(1600))));
}

}  // namespace
}  // namespace tubed::aurora
