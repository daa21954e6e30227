#include "daemon/estimator/view/pose_in_use.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr MonotonicTime kFrom{std::chrono::seconds(10)};

/// A tube of ten lines that lies that far from where it was first, mm.
Eigen::Matrix3Xd place(double away_mm) {
  return Eigen::Matrix3Xd::Constant(3, 10, 0).colwise() + Eigen::Vector3d(away_mm, 0, 0);
}

TEST(PoseInUse, IsGivenUpAfterASecondWithoutTheTube) {
  PoseInUse use(10);
  use.begin(kFrom);
  for (int t_ms = 100; t_ms <= 1000; t_ms += 100) {
    EXPECT_TRUE(use.note(kFrom + milliseconds(t_ms), false, true)) << t_ms;
  }
  EXPECT_FALSE(use.note(kFrom + milliseconds(1100), false, true));
}

TEST(PoseInUse, AnImageThatShowsTheTubeBeginsTheSecondAgain) {
  PoseInUse use(10);
  use.begin(kFrom);
  for (int t_ms = 100; t_ms <= 3000; t_ms += 100) {
    EXPECT_TRUE(use.note(kFrom + milliseconds(t_ms), t_ms % 900 == 0, true)) << t_ms;
  }
}

// Without coils, or a tube in the picture, a right pose would show nothing either.
TEST(PoseInUse, ImagesThatSayNothingDoNotCount) {
  PoseInUse use(10);
  use.begin(kFrom);
  for (int t_ms = 100; t_ms <= 3000; t_ms += 100) {
    EXPECT_TRUE(use.note(kFrom + milliseconds(t_ms), false, false)) << t_ms;
  }
}

TEST(PoseInUse, NorDoesTheTimeWithoutFluoroscopy) {
  PoseInUse use(10);
  use.begin(kFrom);
  EXPECT_TRUE(use.note(kFrom + milliseconds(100), false, true));
  EXPECT_TRUE(use.note(kFrom + milliseconds(20'000), false, true));
  EXPECT_TRUE(use.note(kFrom + milliseconds(20'900), false, true));
  EXPECT_FALSE(use.note(kFrom + milliseconds(21'100), false, true));
}

TEST(PoseInUse, APlaceWhereItWasRefinedIsNoNews) {
  PoseInUse use(10);
  use.begin(kFrom);
  EXPECT_EQ(use.news_of(place(0)), 1);
  use.note_refined_at(place(0));
  use.note_refined_at(place(30));
  EXPECT_EQ(use.news_of(place(0)), 0);
  EXPECT_NEAR(use.news_of(place(25)), 5 / 20.0, 1e-12);
  EXPECT_EQ(use.news_of(place(60)), 1);
  use.begin(kFrom);
  EXPECT_EQ(use.news_of(place(0)), 1) << "of another pose";
}

TEST(PoseInUse, SixteenPlacesAreRemembered) {
  PoseInUse use(10);
  use.begin(kFrom);
  for (int k = 0; k < 17; ++k) use.note_refined_at(place(100.0 * k));
  EXPECT_EQ(use.news_of(place(0)), 1) << "the oldest one made room";
  EXPECT_EQ(use.news_of(place(100)), 0);
  EXPECT_EQ(use.news_of(place(1600)), 0);
}

}  // namespace
}  // namespace tubed
