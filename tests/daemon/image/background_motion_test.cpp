#include "daemon/image/background_motion.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/image/moving_background.hpp"

namespace tubed {
namespace {

using namespace moving_background;

class BackgroundMotionTest : public ::testing::Test {
 protected:
  BackgroundMotion from_still_to(const Shot& shot) {
    ViewPicture before = reducer_.picture();
    ViewPicture now = reducer_.picture();
    reducer_.reduce(fluoroscope_.take({}), 255, before);
    reducer_.reduce(fluoroscope_.take(shot), 255, now);
    BackgroundMotionFinder finder(reducer_.rows(), reducer_.columns());
    return finder.find(before.texture, now.texture, kMmPerPx * reducer_.factor());
  }
  Fluoroscope fluoroscope_{7};
  ViewReducer reducer_{kBackgroundSide, kBackgroundSide};
};

TEST_F(BackgroundMotionTest, APanIsMeasuredToAMillimetre) {
  for (const double pan_mm : {3.0, 12.0, 40.0}) {
    const BackgroundMotion motion = from_still_to({.pan_x_mm = pan_mm, .pan_y_mm = -pan_mm / 2});
    EXPECT_EQ(motion.kind, BackgroundMotion::Kind::kPanned) << pan_mm;
    EXPECT_NEAR(motion.shift_mm.x(), -pan_mm, 1) << "the picture moves against the camera";
    EXPECT_NEAR(motion.shift_mm.y(), pan_mm / 2, 1);
    EXPECT_EQ(motion.magnification, 1);
  }
}

TEST_F(BackgroundMotionTest, AMagnificationIsMeasuredToHalfAPercent) {
  for (const double zoom : {1.03, 0.95, 1.10}) {
    const BackgroundMotion motion = from_still_to({.zoom = zoom});
    EXPECT_EQ(motion.kind, BackgroundMotion::Kind::kMagnified) << zoom;
    EXPECT_NEAR(motion.magnification, zoom, 0.005);
  }
}

// One half of the picture moves by 20 mm, the other not at all.
TEST_F(BackgroundMotionTest, PartsThatMoveDifferentlyAreATurn) {
  EXPECT_EQ(from_still_to({.breath_mm = 20}).kind, BackgroundMotion::Kind::kTurned);
}

TEST_F(BackgroundMotionTest, AnotherBackgroundIsUnknown) {
  ViewPicture before = reducer_.picture();
  ViewPicture now = reducer_.picture();
  reducer_.reduce(fluoroscope_.take({}), 255, before);
  reducer_.reduce(Fluoroscope(8).take({}), 255, now);
  BackgroundMotionFinder finder(reducer_.rows(), reducer_.columns());
  EXPECT_EQ(finder.find(before.texture, now.texture, kMmPerPx).kind, BackgroundMotion::Kind::kUnknown);
  now.texture.setZero();
  EXPECT_EQ(finder.find(before.texture, now.texture, kMmPerPx).kind, BackgroundMotion::Kind::kUnknown);
  EXPECT_EQ(finder.find(now.texture, before.texture, kMmPerPx).kind, BackgroundMotion::Kind::kUnknown);
}

}  // namespace
}  // namespace tubed
