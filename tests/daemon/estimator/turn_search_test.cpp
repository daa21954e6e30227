#include "daemon/estimator/view/turn_search.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "idl/geometry/rigid_transform.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

ViewPose pose_before() { return {geometry_of(one_view_room().cameras[0]), 1200}; }

TEST(TurnSearch, FromEveryStartWhatIsKnownIsThePoseBefore) {
  const ViewPose before = pose_before();
  TurnSearch search;
  EXPECT_TRUE(search.is_over()) << "none has begun";
  search.begin(before);
  std::array<int, TurnSearch::kMoves> starts{};
  while (!search.is_over()) {
    const TurnSearch::Start start = search.next();
    ++starts[start.move];
    const RigidTransform back = start.pose.with_error(start.expected).geometry().T_camera_world();
    EXPECT_TRUE(back.isApprox(before.geometry().T_camera_world(), 1e-9)) << start.expected.transpose();
    EXPECT_NEAR(start.expected.head<2>().norm(),
                std::abs(start.expected[start.move == TurnSearch::kTilt ? 0 : 1]), 1e-12)
        << "about one axis";
  }
  EXPECT_EQ(starts, (std::array<int, TurnSearch::kMoves>{1, 13, 9}));
}

TEST(TurnSearch, TheLikeliestOfEachMoveIsKeptUntilTheNextSearch) {
  TurnSearch search;
  search.begin(pose_before());
  EXPECT_FALSE(search.has_found());
  search.add(TurnSearch::kTurn, {pose_before(), -1, false});
  EXPECT_FALSE(search.has_found());
  search.add(TurnSearch::kTurn, {pose_before(), -5, true});
  search.add(TurnSearch::kTurn, {pose_before(), -3, true});
  search.add(TurnSearch::kTurn, {pose_before(), -4, true});
  EXPECT_TRUE(search.has_found());
  EXPECT_EQ(search.best(TurnSearch::kTurn).log_evidence, -3);
  EXPECT_FALSE(search.best(TurnSearch::kPan).is_found);
  search.begin(pose_before());
  EXPECT_FALSE(search.has_found());
}

/// Images in a row in which the tube is astray, until a search begins.
int images_until_search(TurnSearch& search) {
  for (int images = 1; images < 10'000; ++images) {
    search.note_image(true, pose_before());
    if (search.is_running()) return images;
  }
  return -1;
}

TEST(TurnSearch, AfterEachSearchInVainTheNextOneWaitsTwiceAsLong) {
  TurnSearch search;
  for (const int expected : {16, 32, 64, 128, 256, 512, 512}) {
    EXPECT_EQ(images_until_search(search), expected);
    EXPECT_FALSE(search.is_over());
    search.end();
  }
}

TEST(TurnSearch, AfterOneThatFoundTheTubeItWaitsAsAtFirst) {
  TurnSearch search;
  EXPECT_EQ(images_until_search(search), 16);
  search.end();
  EXPECT_EQ(images_until_search(search), 32);
  search.add(TurnSearch::kTurn, {pose_before(), -3, true});
  search.end();
  EXPECT_EQ(images_until_search(search), 16);
}

TEST(TurnSearch, OneThatIsBegunAtOnceCountsAsWell) {
  TurnSearch search;
  search.begin(pose_before());
  search.end();
  EXPECT_EQ(images_until_search(search), 32);
}

TEST(TurnSearch, AnImageThatHasTheTubeBeginsTheCountAgain) {
  TurnSearch search;
  EXPECT_EQ(images_until_search(search), 16);
  search.end();
  search.note_image(false, pose_before());
  for (int i = 0; i < 15; ++i) search.note_image(true, pose_before());
  search.note_image(false, pose_before());
  EXPECT_EQ(images_until_search(search), 16);
}

TEST(TurnSearch, WhileItRunsImagesNeitherEndItNorBeginItAnew) {
  TurnSearch search;
  search.begin(pose_before());
  static_cast<void>(search.next());
  for (int i = 0; i < 100; ++i) search.note_image(i % 2 == 0, pose_before());
  EXPECT_TRUE(search.is_running());
  EXPECT_EQ(search.next().move, TurnSearch::kTurn) << "the pan was the first one";
}

TEST(TurnSearch, AnotherMoveIsLookedForFromItsBeginning) {
  TurnSearch search;
  EXPECT_EQ(images_until_search(search), 16);
  search.forget();
  EXPECT_FALSE(search.is_running());
  EXPECT_EQ(images_until_search(search), 16);
}

}  // namespace
}  // namespace tubed
