#include "daemon/image/motion_ghosts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "daemon/image/image_checks.hpp"
#include "tests/daemon/image/console_images.hpp"

namespace tubed {
namespace {

constexpr double kNoise = 4;
constexpr int kEveryRow = 4;

/// What so many images of a console are said to be, in an even rhythm.
template <typename Console>
bool ghosts_after(int images, Console console, double share, double noise = kNoise) {
  Detector detector(noise);
  MotionGhosts ghosts(kConsoleWidth, kConsoleHeight, kEveryRow);
  for (int k = 0; k < images; ++k) ghosts.look_at(console.show(detector.expose()), true, share, kRounded);
  return ghosts.are_there();
}

TEST(MotionGhosts, AFilterThatIsTheSameEverywhereWouldLeaveNone) {
  for (const double share : {0.3, 0.5, 0.8}) {
    EXPECT_FALSE(ghosts_after(40, RecursiveConsole(share), share)) << share;
    EXPECT_FALSE(ghosts_after(40, RecursiveConsole(share), share, 1)) << share << ", little noise";
  }
}

TEST(MotionGhosts, OneThatGivesWayWhereSomethingMovesWouldLeaveThem) {
  for (const double share : {0.6, 0.7, 0.8}) {
    EXPECT_TRUE(ghosts_after(40, GatedConsole(share, kNoise), share)) << share;
  }
}

TEST(MotionGhosts, AFewImagesAreNotEnough) {
  EXPECT_FALSE(ghosts_after(8, GatedConsole(0.8, kNoise), 0.8));
  EXPECT_TRUE(ghosts_after(30, GatedConsole(0.8, kNoise), 0.8));
}

TEST(MotionGhosts, WhereNothingMovesThereAreNone) {
  Detector detector(kNoise, 0);
  GatedConsole console(0.8, kNoise);
  MotionGhosts ghosts(kConsoleWidth, kConsoleHeight, kEveryRow);
  for (int k = 0; k < 40; ++k) ghosts.look_at(console.show(detector.expose()), true, 0.8, kRounded);
  EXPECT_FALSE(ghosts.are_there());
}

// Over a missing exposure a tube has moved as far as it would have faded.
TEST(MotionGhosts, OnlyImagesThatFollowEachOtherAreCompared) {
  Detector detector(kNoise);
  GatedConsole console(0.8, kNoise);
  MotionGhosts ghosts(kConsoleWidth, kConsoleHeight, kEveryRow);
  for (int k = 0; k < 40; ++k) ghosts.look_at(console.show(detector.expose()), false, 0.8, kRounded);
  EXPECT_FALSE(ghosts.are_there());
}

TEST(MotionGhosts, AreForgottenWithTheFilter) {
  Detector detector(kNoise);
  GatedConsole console(0.8, kNoise);
  MotionGhosts ghosts(kConsoleWidth, kConsoleHeight, kEveryRow);
  for (int k = 0; k < 20; ++k) ghosts.look_at(console.show(detector.expose()), true, 0.8, kRounded);
  EXPECT_TRUE(ghosts.are_there());
  ghosts.look_at(detector.expose(), true, 0, kRounded);
  EXPECT_FALSE(ghosts.are_there());
  for (int k = 0; k < 8; ++k) ghosts.look_at(console.show(detector.expose()), true, 0.8, kRounded);
  EXPECT_FALSE(ghosts.are_there()) << "eight images have seven changes";
}

TEST(MotionGhosts, ImagesOfNoSizeAndOfFewColumnsSayNothing) {
  for (const int width : {0, 10}) {
    MotionGhosts ghosts(width, width, 1);
    const ConsolePicture picture(static_cast<std::size_t>(width * width), 100.0F);
    for (int k = 0; k < 20; ++k) ghosts.look_at(picture, true, 0.5, kRounded);
    EXPECT_FALSE(ghosts.are_there());
  }
}

TEST(MotionGhosts, WhatHasChangedByMoreThanNoiseIsUndoneLess) {
  Detector detector(kNoise);
  GatedConsole console(0.8, kNoise);
  MotionGhosts ghosts(kConsoleWidth, kConsoleHeight, kEveryRow);
  for (int k = 0; k < 30; ++k) ghosts.look_at(console.show(detector.expose()), true, 0.8, kRounded);
  ASSERT_TRUE(ghosts.are_there());
  std::vector<float> change(kConsoleWidth, 0.0F);
  for (const int x : {100, 198, 199}) change[static_cast<std::size_t>(x)] = 60;
  std::vector<float> weights(kConsoleWidth, -1.0F);
  ghosts.weigh(kConsoleHeight - 1, change, weights);
  EXPECT_NEAR(weights[50], 1, 1e-6);
  EXPECT_NEAR(weights[100], 0.15, 0.15);
  EXPECT_NEAR(weights[199], 0, 0.05) << "beyond the last block";
  EXPECT_NEAR(weights[190], 1, 1e-6);
}

TEST(ImageDoor, UndoesAFilterThatGivesWayAsFarAsItIsOne) {
  ImageDoor undoing(camera_of(TimeAveraging::kUndo));
  ImageDoor keeping(camera_of(TimeAveraging::kKeep));
  const Detector detector(2 * kNoise);
  const GatedConsole console(0.8, 2 * kNoise);
  const double undone = square_off(undoing, detector, console, 60);
  EXPECT_LT(undone, 0.2 * square_off(keeping, detector, console, 60));
  EXPECT_TRUE(undoing.averaging_gives_way());
  EXPECT_FALSE(keeping.averaging_gives_way());
}

}  // namespace
}  // namespace tubed
