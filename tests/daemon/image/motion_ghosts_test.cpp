#include "daemon/image/motion_ghosts.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "daemon/image/image_checks.hpp"
#include "tests/daemon/image/console_images.hpp"

namespace tubed {
namespace {

constexpr double kNoise = 4;
constexpr int kEveryRow = 4;

/// A console's images, in an even rhythm.
template <typename Console>
struct Room {
  explicit Room(Console its, double noise = kNoise, int bands = 1) : detector(noise, bands), console(its) {}

  /// Whether there are ghosts after so many more of them.
  bool ghosts_after(int images, double share, bool follow = true) {
    for (int k = 0; k < images; ++k) ghosts.look_at(console.show(detector.expose()), follow, share, kRounded);
    return ghosts.are_there();
  }

  Detector detector;
  Console console;
  MotionGhosts ghosts{kConsoleWidth, kConsoleHeight, kEveryRow};
};

TEST(MotionGhosts, AFilterThatIsTheSameEverywhereWouldLeaveNone) {
  for (const double share : {0.3, 0.5, 0.8}) {
    EXPECT_FALSE(Room(RecursiveConsole(share)).ghosts_after(40, share)) << share;
    EXPECT_FALSE(Room(RecursiveConsole(share), 1).ghosts_after(40, share)) << share << ", little noise";
  }
}

TEST(MotionGhosts, OneThatGivesWayWhereSomethingMovesWouldLeaveThem) {
  for (const double share : {0.6, 0.7, 0.8}) {
    EXPECT_TRUE(Room(GatedConsole(share, kNoise)).ghosts_after(40, share)) << share;
  }
}

TEST(MotionGhosts, AFewImagesAreNotEnough) {
  Room room(GatedConsole(0.8, kNoise));
  EXPECT_FALSE(room.ghosts_after(8, 0.8));
  EXPECT_TRUE(room.ghosts_after(22, 0.8));
}

TEST(MotionGhosts, WhereNothingMovesThereAreNone) {
  EXPECT_FALSE(Room(GatedConsole(0.8, kNoise), kNoise, 0).ghosts_after(40, 0.8));
}

TEST(MotionGhosts, OnlyImagesThatFollowEachOtherAreCompared) {
  EXPECT_FALSE(Room(GatedConsole(0.8, kNoise)).ghosts_after(40, 0.8, false));
}

TEST(MotionGhosts, AreForgottenWithTheFilter) {
  Room room(GatedConsole(0.8, kNoise));
  EXPECT_TRUE(room.ghosts_after(20, 0.8));
  EXPECT_FALSE(room.ghosts_after(1, 0));
  EXPECT_FALSE(room.ghosts_after(8, 0.8)) << "eight images have seven changes";
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
  Room room(GatedConsole(0.8, kNoise));
  ASSERT_TRUE(room.ghosts_after(30, 0.8));
  std::vector<float> change(kConsoleWidth, 0.0F);
  for (const int x : {100, 198, 199}) change[static_cast<std::size_t>(x)] = 60;
  std::vector<float> weights(kConsoleWidth, -1.0F);
  room.ghosts.weigh(kConsoleHeight - 1, change, weights);
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
