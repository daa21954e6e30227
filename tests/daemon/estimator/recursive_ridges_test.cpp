// Which ridge of an image the recursive estimator takes for its tube.
#include <gtest/gtest.h>

#include <utility>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

TEST(RecursiveRidges, AStretchCaughtBesideTheTubeIsGivenUpOnceTheTubeIsSeen) {
  FilterBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.catch_and_show_again());
  bench.measure_times(4);  // one image: another catheter beside the tube may look better in one
  EXPECT_GT(bench.beside_mm(), 9);
  bench.measure_times(4);
  EXPECT_LT(bench.beside_mm(), 2);
}

/// A second view, which shows the rest of the arc only.
RoomDescription room_with_two_views() {
  RoomDescription room = one_view_room();
  room.cameras.push_back(room.cameras.front());
  room.cameras.back().name = "B";
  room.cameras.back().cy = -80;
  return room;
}

// What one view shows well says nothing about what the other has caught.
TEST(RecursiveRidges, AStretchCaughtInOneViewIsGivenUpThoughAnotherShowsItsOwnWell) {
  FilterBench bench(room_with_two_views());
  ASSERT_NO_FATAL_FAILURE(bench.catch_and_show_again());
  ASSERT_GT(bench.estimate->image_inlier_ratio, 0.9F);
  bench.measure_times(8);
  EXPECT_LT(bench.beside_mm(), 2);
}

// A second catheter is laid 3 mm beside a tube that has been tracked for a second, and is the clearer one.
TEST(RecursiveRidges, AnotherTubeBesideTheTrackedOneIsNotFollowed) {
  FilterBench bench;
  bench.measure_times(44);
  ASSERT_LT(bench.beside_mm(), 1);
  bench.other_tube_mm = 3;
  for (int i = 0; i < 120; ++i) {
    bench.measure();
    ASSERT_LT(bench.beside_mm(), 1) << "measurement " << i;
  }
}

// At an image; coils are up to 4 mm off, the other tube is the clearer one. The image alone takes it each
// time.
TEST(RecursiveRidges, OfTwoTubesItBeginsWithTheOneWhereTheCoilsExpectIt) {
  int right = 0;
  for (unsigned draw = 0; draw < 20; ++draw) {
    FilterBench bench;
    bench.seed = 100 * draw + 3;
    bench.tube_contrast = 0.5F;
    bench.other_tube_mm = 4;
    bench.measure();
    right += bench.beside_mm() < 1 ? 1 : 0;
  }
  EXPECT_GE(right, 18);
}

}  // namespace
}  // namespace tubed
