// The ring of past states, and when a shape is given up.
#include "daemon/estimator/tube_state.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

const TubeMap& map() {
  static const TubeMap map(EstimatorSettings{}, 380, 5, 1);
  return map;
}

TubeState state_at(std::int64_t ms, double mark = 0) {
  TubeState state(map(), EstimatorSettings{}, 5);
  state.begun = true;
  state.tube.time = from_ns(ms * 1'000'000);
  state.tube.C(0, 0) = mark;
  return state;
}

TEST(StateHistory, GoesBackToTheNewestStateThatIsNotYounger) {
  TubeState state = state_at(90);
  StateHistory past(state_at(0));
  past.forget();
  for (const std::int64_t ms : {10, 20, 30, 40}) past.remember(state_at(ms));
  past.go_back(from_ns(25'000'000), state);
  EXPECT_EQ(state.tube.time, from_ns(20'000'000));
  past.go_back(from_ns(50'000'000), state);  // 30 and 40 have not seen what came at 25
  EXPECT_EQ(state.tube.time, from_ns(20'000'000));
}

TEST(StateHistory, OfTwoStatesOfOneTimeTheLaterOneCounts) {
  TubeState state = state_at(90);
  StateHistory past(state_at(0));
  past.forget();
  past.remember(state_at(10, 1));
  past.remember(state_at(10, 2));
  past.go_back(from_ns(10'000'000), state);
  EXPECT_EQ(state.tube.C(0, 0), 2);
}

TEST(StateHistory, BeforeAllThatIsRememberedTheStateStays) {
  TubeState state = state_at(90);
  StateHistory past(state_at(0));
  past.forget();
  for (std::int64_t ms = 10; ms < 200; ms += 10) past.remember(state_at(ms));  // more than it holds
  past.go_back(from_ns(15'000'000), state);
  EXPECT_EQ(state.tube.time, from_ns(90'000'000));
}

TEST(ShapeDoubt, TwoImagesOfOneEmMeasurementAreOneWitness) {
  ShapeDoubt doubt;
  doubt.add(1, from_ns(1));
  doubt.add(1, from_ns(1));
  EXPECT_TRUE(doubt.any());
  EXPECT_FALSE(doubt.is_certain());
  doubt.add(1, from_ns(2));
  EXPECT_TRUE(doubt.is_certain());
}

TEST(ShapeDoubt, TwoCoilsOfOneMeasurementAreTwo) {
  ShapeDoubt doubt;
  doubt.add(2, from_ns(1));
  EXPECT_TRUE(doubt.is_certain());
  doubt.clear();
  EXPECT_FALSE(doubt.any());
}

TEST(TubeState, IsLostAfterThreeImagesWithoutTheTubeUntilDoubtsAreForgotten) {
  TubeState state = state_at(0);
  state.images.without_tube = 2;
  EXPECT_FALSE(state.is_lost());
  state.images.without_tube = 3;
  EXPECT_TRUE(state.is_lost());
  state.forget_doubts();
  EXPECT_FALSE(state.is_lost());
  state.doubt.make_certain();
  EXPECT_TRUE(state.is_lost());
}

TEST(ImageRecord, AnImageConfirmsForHalfASecond) {
  ImageRecord images(26);
  EXPECT_FALSE(images.confirm_at(from_ns(1)));  // never one
  images.confirmed = from_ns(1'000'000'000);
  EXPECT_TRUE(images.confirm_at(from_ns(1'400'000'000)));
  EXPECT_FALSE(images.confirm_at(from_ns(1'600'000'000)));
}

}  // namespace
}  // namespace tubed
