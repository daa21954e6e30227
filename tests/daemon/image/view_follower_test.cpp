#include "daemon/image/view_follower.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/daemon/image/moving_background.hpp"

namespace tubed {
namespace {

using namespace moving_background;

/// A follower that has seen nine seconds of an unmoved, breathing patient.
class ViewFollowerTest : public ::testing::Test {
 protected:
  ViewFollowerTest() { look_for(9, {}); }

  const ViewVerdict& look(Shot shot) {
    shot.breath_mm = 6 * (0.5 - 0.5 * std::cos(2 * 3.14159265 * fluoroscope_.time_s() / 4.0));
    return follower_.observe(fluoroscope_.take(shot));
  }

  void look_for(double seconds, const Shot& shot) {
    for (int i = 0; i < std::lround(15 * seconds); ++i) look(shot);
  }

  Fluoroscope fluoroscope_;
  ViewFollower follower_{kBackgroundSide, kBackgroundSide, kMmPerPx};
};

TEST_F(ViewFollowerTest, AViewThatStaysHasNotGoneAnywhere) {
  EXPECT_EQ(follower_.newest().state, ViewState::kStill);
  EXPECT_EQ(follower_.newest().moves, 0U);
  EXPECT_FALSE(follower_.newest().has_settled);
}

TEST_F(ViewFollowerTest, AViewThatMovedSettlesWhereItIs) {
  look_for(0.5, {.pan_x_mm = 8});
  EXPECT_FALSE(follower_.newest().has_settled) << "after half a second";
  look_for(5, {.pan_x_mm = 8});
  EXPECT_EQ(follower_.newest().state, ViewState::kMoved);
  EXPECT_TRUE(follower_.newest().has_settled);
  EXPECT_EQ(follower_.newest().moves, 1U);
  EXPECT_EQ(follower_.newest().motion.kind, BackgroundMotion::Kind::kPanned);
  EXPECT_NEAR(follower_.newest().motion.shift_mm.norm(), 8, 1.5);
}

// The motion is looked at again where it ends: at the third image the pan was still under way.
TEST_F(ViewFollowerTest, APanThatTakesItsTimeSettlesAtItsEnd) {
  for (int i = 1; i <= 45; ++i) {
    look({.pan_x_mm = 15 * i / 45.0});
    EXPECT_FALSE(follower_.newest().has_settled) << "image " << i;
  }
  look_for(6, {.pan_x_mm = 15});
  EXPECT_TRUE(follower_.newest().has_settled);
  EXPECT_NEAR(follower_.newest().motion.shift_mm.norm(), 15, 2);
}

TEST_F(ViewFollowerTest, ThatItMovesOnIsAnotherPlace) {
  look_for(8, {.pan_x_mm = 8});
  ASSERT_TRUE(follower_.newest().has_settled);
  EXPECT_TRUE(look({.pan_x_mm = 20}).is_suspect_here) << "at the first image";
  look_for(0.5, {.pan_x_mm = 20});
  EXPECT_GT(follower_.newest().moves, 1U);
  EXPECT_FALSE(follower_.newest().has_settled);
  look_for(6, {.pan_x_mm = 20});
  EXPECT_TRUE(follower_.newest().has_settled);
}

TEST_F(ViewFollowerTest, AViewThatIsBackIsWhereItsPoseSays) {
  look_for(8, {.pan_x_mm = 8});
  look_for(3, {});
  EXPECT_EQ(follower_.newest().state, ViewState::kStill);
  EXPECT_FALSE(follower_.newest().has_settled);
}

}  // namespace
}  // namespace tubed
