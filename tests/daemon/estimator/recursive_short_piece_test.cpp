// A short piece of tube in view, with which an image of something else agrees now and then.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

/// The first view sees so little of the arc that fewer than 40 lines stand on it.
RoomDescription room_with_a_short_piece_in_view() {
  RoomDescription room = one_view_room();
  room.cameras.front().height = 50;
  room.cameras.front().cy = 130;
  return room;
}

bool is_lost(const FilterBench& bench) { return bench.estimate->reasons.has(Reason::kImageLostTube); }

/// Is the tube lost at an image, 25 ms later, with the whole arc in it or with nothing?
bool is_lost_at(FilterBench& bench, bool is_shown) {
  bench.with_images = false;
  bench.measure();
  bench.hidden = is_shown ? Stretch{} : Stretch{-1, 400};
  bench.show_image(std::chrono::milliseconds(5));
  return is_lost(bench);
}

TEST(RecursiveShortPiece, IsBelievedAtTheThirdImageInARowAndThenAtEachOne) {
  FilterBench bench(room_with_a_short_piece_in_view());
  bench.with_images = false;
  bench.measure_times(20);
  EXPECT_TRUE(is_lost_at(bench, false));
  EXPECT_TRUE(is_lost_at(bench, false));  // at a third one it would begin anew
  EXPECT_TRUE(is_lost_at(bench, true));
  ASSERT_GT(bench.estimate->in_view_ratio, 0);
  ASSERT_LT(bench.estimate->in_view_ratio, 0.2F);
  ASSERT_GT(bench.estimate->image_inlier_ratio, 0.8F);
  EXPECT_TRUE(is_lost_at(bench, true));
  for (int image = 0; image < 10; ++image) {
    EXPECT_FALSE(is_lost_at(bench, true)) << "image " << image;
    EXPECT_TRUE(bench.estimate->has_image);
  }
}

TEST(RecursiveShortPiece, ThatIsSeenInEveryOtherImageIsNotBelieved) {
  FilterBench bench(room_with_a_short_piece_in_view());
  bench.with_images = false;
  bench.measure_times(20);
  for (int image = 0; image < 20; ++image) {
    EXPECT_TRUE(is_lost_at(bench, image % 2 == 0)) << "image " << image;
    EXPECT_FALSE(bench.estimate->has_image);
  }
}

TEST(RecursiveShortPiece, IsNotBelievedWhereAShapeBegins) {
  FilterBench bench(room_with_a_short_piece_in_view());
  bench.seed = 3;  // the first measurement brings an image
  bench.measure();
  EXPECT_TRUE(is_lost(bench));
  EXPECT_FALSE(bench.estimate->has_image);
}

/// From the next image on the view looks elsewhere and says so: little more than the tip is in it.
void turn_away(FilterBench& bench) {
  CameraCalibration& camera = bench.room.cameras.front();
  camera.cy = 680;
  const Eigen::Vector3d t = camera.T_camera_world.translation();
  bench.own_geometry =
      ViewGeometry{camera.fx, camera.fy, camera.cx, camera.cy, {1, 0, 0, 0}, {t.x(), t.y(), t.z()}, {}};
}

// One image of all of the tube in which something hid it, and then the view turns.
TEST(RecursiveShortPiece, IsBelievedAfterAnImageOfAllOfItThatDidNotShowIt) {
  FilterBench bench;
  bench.measure_times(40);
  ASSERT_FALSE(is_lost(bench));
  EXPECT_TRUE(is_lost_at(bench, false));
  turn_away(bench);
  is_lost_at(bench, true);
  is_lost_at(bench, true);
  EXPECT_FALSE(is_lost_at(bench, true)) << "the third one in a row";
}

TEST(RecursiveShortPiece, OfATubeThatTheImageBeforeShowedIsBelievedAtOnce) {
  for (const unsigned first_seed : {3U, 4U}) {  // a shape that begins with an image, and one that does not
    FilterBench bench;
    bench.seed = first_seed;
    bench.measure();
    if (first_seed != 3) {
      ASSERT_FALSE(is_lost_at(bench, true));
    }
    turn_away(bench);
    EXPECT_FALSE(is_lost_at(bench, true)) << first_seed;
    EXPECT_GT(bench.estimate->in_view_ratio, 0);
    EXPECT_LT(bench.estimate->in_view_ratio, 0.2F);
  }
}

// More of it agrees with noise in one image of a hundred.
TEST(RecursiveShortPiece, OfMoreLinesIsBelievedAtOnce) {
  FilterBench bench;
  bench.seed = 3;
  bench.measure();
  EXPECT_FALSE(is_lost(bench));
  for (int image = 0; image < 20; ++image) {
    EXPECT_EQ(is_lost_at(bench, image % 2 == 0), image % 2 != 0) << "image " << image;
  }
}

}  // namespace
}  // namespace tubed
