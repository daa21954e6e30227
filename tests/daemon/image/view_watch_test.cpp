#include "daemon/image/view_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/daemon/image/moving_background.hpp"

namespace tubed {
namespace {

using namespace moving_background;

/// A watch that has seen nine seconds of an unmoved, breathing patient.
class ViewWatchTest : public ::testing::Test {
 protected:
  ViewWatchTest() {
    for (int i = 0; i < 135; ++i) look({});
  }

  const ViewVerdict& look(Shot shot) {
    shot.breath_mm = 6 * (0.5 - 0.5 * std::cos(2 * 3.14159265 * fluoroscope_.time_s() / 4.0));
    return watch_.observe(fluoroscope_.take(shot));
  }

  Fluoroscope fluoroscope_;
  ViewWatch watch_{kBackgroundSide, kBackgroundSide, kMmPerPx};
};

TEST_F(ViewWatchTest, AnUnmovedViewIsStillThroughManyBreathsAndChangesOfExposure) {
  for (int i = 0; i < 300; ++i) {
    Shot shot;
    shot.gain = i / 50 % 2 == 0 ? 1 : 0.7;
    ASSERT_EQ(look(shot).state, ViewState::kStill) << "image " << i << ", S " << watch_.newest().still_share;
  }
}

TEST_F(ViewWatchTest, APanIsSuspectAtTheFirstImageAndMovedAtTheThird) {
  const Shot panned{.pan_x_mm = 3};
  EXPECT_EQ(look(panned).state, ViewState::kSuspect);
  look(panned);
  EXPECT_EQ(look(panned).state, ViewState::kMoved);
  EXPECT_LT(watch_.newest().still_share, 0.35);
}

// A recording of a bench without a patient that begins anew, and goes on with other pictures.
TEST(ViewWatchOfNoise, PicturesThatAreShownAgainAreNoBackground) {
  Fluoroscope fluoroscope;
  ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
  for (const unsigned first : {1U, 1U, 1U, 500U}) {
    for (unsigned i = 0; i < 60; ++i) {
      const ViewVerdict& verdict = watch.observe(fluoroscope.take({.gain = 0, .noise_seed = first + i}));
      ASSERT_EQ(verdict.state, ViewState::kUnjudged) << first << " " << i << ", S " << verdict.still_share;
    }
  }
  EXPECT_EQ(watch.newest().why, UnjudgedView::kNoBackground);
}

TEST_F(ViewWatchTest, AZoomOfFivePercentIsNoticedAtTheFirstImage) {
  EXPECT_EQ(look({.zoom = 1.05}).state, ViewState::kSuspect);
}

TEST_F(ViewWatchTest, WhatMovedWhileFluoroscopyWasOffIsNoticedAtTheFirstImage) {
  fluoroscope_.stay_off_for(milliseconds(20'000));
  EXPECT_EQ(look({.pan_y_mm = 10}).state, ViewState::kSuspect);
}

// A machine that is busy elsewhere looks at every tenth image: a breath goes on meanwhile.
TEST_F(ViewWatchTest, ImagesThatWereLeftOutAreNoMove) {
  for (int i = 0; i < 60; ++i) {
    fluoroscope_.stay_off_for(milliseconds(400));
    ASSERT_EQ(look({}).state, ViewState::kStill) << "image " << i << ", jump " << watch_.newest().jump_share;
  }
}

TEST_F(ViewWatchTest, FluoroscopyThatWasOffAloneIsNoMove) {
  fluoroscope_.stay_off_for(milliseconds(20'000));
  EXPECT_EQ(look({}).state, ViewState::kStill);
}

TEST_F(ViewWatchTest, ASlowPanIsNoticedAndDoesNotCarryTheGalleryAlong) {
  double pan_mm = 0;
  while (pan_mm < 10 && watch_.newest().state != ViewState::kMoved) {
    pan_mm += 0.1;  // 1.5 mm/s
    look({.pan_x_mm = pan_mm});
  }
  EXPECT_LT(pan_mm, 3);
  for (int i = 0; i < 200; ++i) look({.pan_x_mm = pan_mm});
  EXPECT_EQ(watch_.newest().state, ViewState::kMoved);
}

// So slow that images lie between "known" and "moved" for a while, where newcomers are taken.
TEST_F(ViewWatchTest, AVerySlowPanIsNoticedBeforeItHasGoneTwoMillimetres) {
  double pan_mm = 0;
  while (pan_mm < 4 && watch_.newest().state != ViewState::kMoved) {
    pan_mm += 0.02;  // 0.3 mm/s
    look({.pan_x_mm = pan_mm});
  }
  EXPECT_LT(pan_mm, 2);
}

TEST_F(ViewWatchTest, ADeeperBreathIsLearntOnceItHasComeBack) {
  const std::size_t keys = watch_.key_count();
  double min_share = 1;
  for (int i = 0; i < 240; ++i) {
    Shot shot;
    shot.breath_mm = 11 * (0.5 - 0.5 * std::cos(2 * 3.14159265 * fluoroscope_.time_s() / 4.0));
    watch_.observe(fluoroscope_.take(shot));
    ASSERT_EQ(watch_.newest().state, ViewState::kStill)
        << "image " << i << ", S " << watch_.newest().still_share;
    if (i >= 180) min_share = std::min(min_share, watch_.newest().still_share);
  }
  EXPECT_GT(watch_.key_count(), keys);
  EXPECT_GE(min_share, 0.6) << "after three breaths";
}

// As many blocks would do for a phase of the breath that comes slowly.
TEST_F(ViewWatchTest, AJumpToWhatIsHalfKnownIsSuspect) {
  ASSERT_EQ(watch_.observe(fluoroscope_.take({})).state, ViewState::kStill);
  EXPECT_EQ(watch_.observe(fluoroscope_.take({.zoom = 1.0044, .breath_mm = 6})).state, ViewState::kSuspect);
  EXPECT_GE(watch_.newest().still_share, 0.35) << "jump " << watch_.newest().jump_share;
}

// About a fifth of the blocks, those in the middle, are where they were.
TEST_F(ViewWatchTest, AMoveThatLeavesTheMiddleWhereItWasIsAMove) {
  for (int i = 0; i < 3; ++i) look({.zoom = 1.009});
  EXPECT_GT(watch_.newest().still_share, 0.1);
  EXPECT_EQ(watch_.newest().state, ViewState::kMoved);
}

TEST_F(ViewWatchTest, AViewThatIsBackIsStillAgainAfterASecond) {
  for (int i = 0; i < 5; ++i) look({.pan_x_mm = 8});
  ASSERT_EQ(look({}).state, ViewState::kMoved);
  for (int i = 0; i < 20; ++i) look({});
  EXPECT_EQ(watch_.newest().state, ViewState::kStill);
}

TEST_F(ViewWatchTest, BladesThatCloseAlarmNobodyAndAreSaid) {
  for (int i = 0; i < 15; ++i) {
    look({.blade_px = 4 * i});
    ASSERT_TRUE(watch_.newest().state == ViewState::kStill || watch_.newest().state == ViewState::kUnjudged)
        << "image " << i << ", S " << watch_.newest().still_share << ", jump " << watch_.newest().jump_share;
  }
  for (int i = 0; i < 5; ++i) look({.blade_px = 90});
  EXPECT_EQ(watch_.newest().state, ViewState::kUnjudged);
  EXPECT_EQ(watch_.newest().why, UnjudgedView::kFewBlocks);
}

TEST_F(ViewWatchTest, WhatMovedStaysMovedBehindBlades) {
  for (int i = 0; i < 5; ++i) look({.pan_x_mm = 8});
  EXPECT_EQ(look({.pan_x_mm = 8, .blade_px = 90}).state, ViewState::kMoved);
}

TEST_F(ViewWatchTest, WhatMayHaveMovedStaysInDoubtBehindBlades) {
  ASSERT_EQ(look({.pan_x_mm = 8}).state, ViewState::kSuspect);
  EXPECT_EQ(look({.pan_x_mm = 8, .blade_px = 90}).state, ViewState::kSuspect);
  EXPECT_EQ(look({.blade_px = 0}).state, ViewState::kStill);
}

TEST_F(ViewWatchTest, ANewPoseIsLearntAnew) {
  for (int i = 0; i < 5; ++i) look({.pan_x_mm = 8});
  ASSERT_EQ(watch_.newest().state, ViewState::kMoved);
  watch_.begin(from_ns(0));
  EXPECT_EQ(watch_.newest().state, ViewState::kUnjudged);
  EXPECT_EQ(watch_.newest().why, UnjudgedView::kLearning);
  EXPECT_EQ(watch_.key_count(), 0U);
}

TEST(ViewWatch, APictureWithoutBackgroundIsUnjudgedAndNeverStill) {
  ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
  Fluoroscope fluoroscope;
  for (int i = 0; i < 150; ++i) {
    watch.observe(fluoroscope.take({.gain = 0}));
    ASSERT_EQ(watch.newest().state, ViewState::kUnjudged) << "image " << i;
  }
  EXPECT_NE(watch.newest().why, UnjudgedView::kNone);
}

// A wide breath, of which a busy machine shows every third image: the pictures change slowly and come back.
TEST(ViewWatch, ABreathIsNoMoveWhileTheViewIsLearnt) {
  ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
  Fluoroscope fluoroscope;
  for (int i = 0; i < 40; ++i) {
    const double breath_mm = 20 * (0.5 - 0.5 * std::cos(2 * 3.14159265 * fluoroscope.time_s() / 4.0));
    watch.observe(fluoroscope.take({.breath_mm = breath_mm}));
    ASSERT_EQ(watch.newest().state, ViewState::kUnjudged)
        << "image " << i << ", S " << watch.newest().still_share << ", jump " << watch.newest().jump_share;
    fluoroscope.stay_off_for(milliseconds(70));
  }
}

TEST(ViewWatch, ASuddenMoveIsNoticedWhileTheViewIsLearntAndIsNotLearnt) {
  ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
  Fluoroscope fluoroscope;
  for (int i = 0; i < 30; ++i) watch.observe(fluoroscope.take({}));
  EXPECT_EQ(watch.observe(fluoroscope.take({.pan_x_mm = 6})).state, ViewState::kSuspect);
  for (int i = 0; i < 60; ++i) watch.observe(fluoroscope.take({.pan_x_mm = 6}));
  EXPECT_EQ(watch.newest().state, ViewState::kMoved);
}

// Four images a second, and one: a breath alone is none of these moves.
TEST(ViewWatch, AMoveBetweenImagesThatAreFarApartIsNoticedWhileTheViewIsLearnt) {
  for (const int off_ms : {180, 930}) {
    ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
    Fluoroscope fluoroscope;
    const auto look = [&](Shot shot) {
      shot.breath_mm = 20 * (0.5 - 0.5 * std::cos(2 * 3.14159265 * fluoroscope.time_s() / 4.0));
      return watch.observe(fluoroscope.take(shot)).state;
    };
    for (int i = 0; fluoroscope.time_s() < 4; ++i) {
      ASSERT_EQ(look({}), ViewState::kUnjudged) << off_ms << " ms, image " << i;
      fluoroscope.stay_off_for(milliseconds(off_ms));
    }
    EXPECT_EQ(look({.pan_x_mm = 3}), ViewState::kSuspect) << off_ms << " ms";
    for (int i = 0; i < 30; ++i) {
      fluoroscope.stay_off_for(milliseconds(off_ms));
      look({.pan_x_mm = 3});
    }
    EXPECT_EQ(watch.newest().state, ViewState::kMoved) << off_ms << " ms, and it is not learnt";
  }
}

// Nothing has come back yet that would show a background: then it is not said that the view stands still.
TEST(ViewWatch, AMoveAfterTheFirstImageOfAllIsNotLearnt) {
  ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
  Fluoroscope fluoroscope;
  watch.observe(fluoroscope.take({}));
  fluoroscope.stay_off_for(milliseconds(2500));
  for (int i = 0; i < 150; ++i) {
    ASSERT_EQ(watch.observe(fluoroscope.take({.pan_x_mm = 5})).state, ViewState::kUnjudged) << "image " << i;
  }
}

TEST(ViewWatch, WhileItLearnsItSaysSo) {
  ViewWatch watch(kBackgroundSide, kBackgroundSide, kMmPerPx);
  Fluoroscope fluoroscope;
  const ViewVerdict& verdict = watch.observe(fluoroscope.take({}));
  EXPECT_EQ(verdict.state, ViewState::kUnjudged);
  EXPECT_EQ(verdict.why, UnjudgedView::kLearning);
}

TEST(MmPerPxInPatient, IsTheDepthOfWhatItLooksAtOverTheFocalLengthWithinACArm) {
  CameraCalibration camera;
  camera.fx = camera.fy = 1000;
  camera.T_camera_world.translation().z() = 1200;
  EXPECT_DOUBLE_EQ(mm_per_px_in_patient(camera), 1.2);
  camera.T_camera_world.translation().z() = -40;
  EXPECT_DOUBLE_EQ(mm_per_px_in_patient(camera), 0.3);
  camera.T_camera_world.translation().z() = 9000;
  EXPECT_DOUBLE_EQ(mm_per_px_in_patient(camera), 1.5);
}

TEST(ViewReducer, GainAndOffsetDoNotMatter) {
  Fluoroscope fluoroscope;
  ViewReducer reducer(kBackgroundSide, kBackgroundSide);
  ViewPicture dim = reducer.picture();
  ViewPicture bright = reducer.picture();
  ImageFrame frame = fluoroscope.take({.gain = 0.8});
  reducer.reduce(frame, 255, dim);
  for (std::uint8_t& pixel : frame.pixels) pixel = static_cast<std::uint8_t>(std::min(255, pixel / 2 + 90));
  reducer.reduce(frame, 255, bright);
  const PixelGrid texture = dim.texture.cast<float>();
  const float difference = std::sqrt((texture - bright.texture.cast<float>()).square().mean());
  EXPECT_LT(difference, 0.25 * std::sqrt(texture.square().mean()));
}

TEST(ViewReducer, WordsOf16BitsGiveTheSamePicture) {
  Fluoroscope fluoroscope;
  ViewReducer reducer(kBackgroundSide, kBackgroundSide);
  ViewPicture bytes = reducer.picture();
  ViewPicture words = reducer.picture();
  ImageFrame frame = fluoroscope.take({});
  reducer.reduce(frame, 255, bytes);
  ImageFrame wide = frame;
  wide.depth = PixelDepth::kGrey16;
  wide.pixels.resize(2 * frame.pixels.size());
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
    const auto word = static_cast<std::uint16_t>(frame.pixels[i] * 16);
    std::memcpy(&wide.pixels[2 * i], &word, sizeof word);
  }
  reducer.reduce(wide, 255 * 16, words);
  EXPECT_LE((bytes.texture - words.texture).abs().maxCoeff(), 1) << "in units of 1 / kTextureUnit";
}

TEST(ViewReducer, TooSmallAnImageIsRefused) { EXPECT_THROW(ViewReducer(63, 400), std::invalid_argument); }

TEST(ViewKey, AsksWhetherBlocksAreWhereTheyWereToSixTenthsOfAMillimetre) {
  Fluoroscope fluoroscope;
  ViewReducer reducer(kBackgroundSide, kBackgroundSide);
  ViewPicture picture = reducer.picture();
  ViewBlocks blocks(reducer.rows(), reducer.columns());
  ViewKey key(reducer.rows(), reducer.columns());
  const auto share_after = [&](double pan_mm) {
    reducer.reduce(fluoroscope.take({.pan_x_mm = pan_mm}), 255, picture);
    blocks.take(picture);
    return key.compare(blocks, kMmPerPx).share();
  };
  share_after(0);
  key.take(picture, blocks);
  EXPECT_GT(share_after(0), 0.98);
  EXPECT_GT(share_after(0.3), 0.95);
  EXPECT_LT(share_after(0.9), 0.05);
  EXPECT_LT(share_after(15), 0.05);
}

}  // namespace
}  // namespace tubed
