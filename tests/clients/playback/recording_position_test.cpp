#include "clients/playback/recording_position.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tubed {
namespace {

RecordingPosition ready_position() {
  RecordingPosition position({10, 10.5, 11, 12});
  position.set_ready(4);
  position.advance(100);
  return position;
}

TEST(RecordingPosition, NothingIsShownUntilAnInstantIsReady) {
  RecordingPosition position({10, 11});
  position.advance(100);
  position.advance(101);
  EXPECT_EQ(position.instant(), std::nullopt);
  EXPECT_EQ(position.t_s(), 10);
  position.seek(11, 101);
  EXPECT_EQ(position.t_s(), 10);
}

TEST(RecordingPosition, GoesOnWithTimeAndStandsStillAtTheEnd) {
  RecordingPosition position = ready_position();
  position.advance(100.6);
  EXPECT_NEAR(position.t_s(), 10.6, 1e-9);
  EXPECT_EQ(position.instant(), 1U);
  EXPECT_TRUE(position.is_playing());
  position.advance(105);
  EXPECT_EQ(position.t_s(), 12);
  EXPECT_EQ(position.instant(), 3U);
  EXPECT_FALSE(position.is_playing());
}

TEST(RecordingPosition, PlayedAtTheEndItBeginsAnew) {
  RecordingPosition position = ready_position();
  position.advance(200);
  position.play(201);
  EXPECT_EQ(position.t_s(), 10);
  EXPECT_TRUE(position.is_playing());
}

TEST(RecordingPosition, WaitsForWhatIsNotReadyAndGoesOnByItself) {
  RecordingPosition position({10, 11, 12});
  position.set_ready(2);
  position.advance(100);
  position.advance(150);
  EXPECT_EQ(position.t_s(), 11);
  EXPECT_TRUE(position.is_playing());
  position.set_ready(3);
  position.advance(150.5);
  EXPECT_NEAR(position.t_s(), 11.5, 1e-9);
}

TEST(RecordingPosition, PausedItStandsStill) {
  RecordingPosition position = ready_position();
  position.pause(100.2);
  position.advance(200);
  EXPECT_NEAR(position.t_s(), 10.2, 1e-9);
  position.play(200);
  position.advance(200.1);
  EXPECT_NEAR(position.t_s(), 10.3, 1e-9);
}

TEST(RecordingPosition, SeekingStaysInsideWhatIsReady) {
  RecordingPosition position = ready_position();
  position.pause(100);
  position.set_ready(3);
  position.seek(1e9, 100);
  EXPECT_EQ(position.t_s(), 11);
  position.seek(-5, 100);
  EXPECT_EQ(position.t_s(), 10);
  position.seek(10.7, 100);
  EXPECT_EQ(position.instant(), 1U);
  position.seek(std::numeric_limits<double>::quiet_NaN(), 100);
  EXPECT_EQ(position.t_s(), 10.7);
}

TEST(RecordingPosition, StepsFromInstantToInstantAndStandsStill) {
  RecordingPosition position = ready_position();
  position.seek(10.7, 100);
  position.step(1, 100);
  EXPECT_EQ(position.t_s(), 11);
  EXPECT_FALSE(position.is_playing());
  position.step(-1, 100);
  EXPECT_EQ(position.t_s(), 10.5);
  position.step(-100, 100);
  EXPECT_EQ(position.t_s(), 10);
  position.step(100, 100);
  EXPECT_EQ(position.t_s(), 12);
}

TEST(RecordingPosition, ItsSpeedHoldsFromThenOnAndHasLimits) {
  RecordingPosition position = ready_position();
  position.set_speed(0.5, 100.2);
  position.advance(100.6);
  EXPECT_NEAR(position.t_s(), 10.4, 1e-9);
  position.set_speed(1e6, 100.6);
  EXPECT_EQ(position.speed(), RecordingPosition::kMaxSpeed);
  position.set_speed(-1, 100.6);
  EXPECT_EQ(position.speed(), RecordingPosition::kMinSpeed);
}

TEST(RecordingPosition, ARecordingOfOneInstantIsShown) {
  RecordingPosition position({3});
  position.set_ready(1);
  position.advance(100);
  position.advance(101);
  EXPECT_EQ(position.instant(), 0U);
  EXPECT_FALSE(position.is_playing());
}

}  // namespace
}  // namespace tubed
