#include "daemon/estimator/agreement/room_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

RoomDescription a_room() {
  RoomDescription room;
  CameraCalibration camera;
  camera.T_camera_world.translation() = Eigen::Vector3d(0, 0, 1200);  // looks at the world's origin
  room.cameras = {camera};
  InstrumentDescription instrument;
  instrument.coils = {{.sensor = 1, .offset_from_tip_mm = 10}, {.sensor = 2, .offset_from_tip_mm = 90}};
  room.instruments = {instrument};
  return room;
}

RoomErrors errors_of(const RoomDescription& room) { return room_errors(room, room.instruments.front()); }

TEST(RoomErrors, ARoomThatSaysNothingHasTheUsualOnes) {
  const RoomErrors errors = errors_of(a_room());

  EXPECT_EQ(errors.shift_mm, RoomErrors().shift_mm);
  EXPECT_EQ(errors.turn_rad, RoomErrors().turn_rad);
  EXPECT_EQ(errors.arc_length_mm, RoomErrors().arc_length_mm);
  EXPECT_EQ(errors.magnification, RoomErrors().magnification);
  EXPECT_EQ(errors.clock_s, RoomErrors().clock_s);
}

TEST(RoomErrors, AClockThatWasMeasuredIsKnownAsWellAsItWasButNotExactly) {
  RoomDescription room = a_room();
  room.cameras[0].time_offset_sigma_ms = 6.0;
  EXPECT_NEAR(errors_of(room).clock_s, 0.006, 1e-12);

  room.cameras[0].time_offset_sigma_ms = 0.1;
  EXPECT_NEAR(errors_of(room).clock_s, 0.003, 1e-12);
}

TEST(RoomErrors, ATurnAboutMarkersFarAwayIsAShiftWhereTheCameraLooks) {
  RoomDescription room = a_room();
  room.registration_quality = RegistrationQuality{};
  room.registration_quality->centre_world_mm = Eigen::Vector3d(0, 300, 0);
  room.registration_quality->covariance.diagonal() << 1e-4, 1e-4, 1e-4, 0.25, 0.25, 0.25;

  const RoomErrors errors = errors_of(room);

  // 0.01 rad over 300 mm are 3 mm along x and z; along y the shift alone is left.
  EXPECT_NEAR(errors.shift_mm, std::sqrt((2 * (0.25 + 9) + 0.25) / 3), 1e-12);
  EXPECT_NEAR(errors.turn_rad, 0.01, 1e-12);
}

TEST(RoomErrors, AResidualStandsForARegistrationWithoutACovariance) {
  RoomDescription room = a_room();
  room.registration_residual_mm = 2 * std::sqrt(3.0);

  EXPECT_NEAR(errors_of(room).shift_mm, 2, 1e-12);
  EXPECT_NEAR(errors_of(room).turn_rad, 2 * RoomErrors().turn_rad, 1e-12);
}

TEST(RoomErrors, ARegistrationThatIsTooGoodToBeTrueIsNotBelievedToBeExact) {
  RoomDescription room = a_room();
  room.registration_residual_mm = 0.0;

  EXPECT_NEAR(errors_of(room).shift_mm, 0.2, 1e-12);
}

TEST(RoomErrors, CamerasAddWhatTheyDoNotKnowOfTheirPose) {
  RoomDescription room = a_room();
  room.cameras.front().pose_sigma_mm = {0.6, 0.6, 0.6};
  room.cameras.front().pose_sigma_deg = {0.3, 0.3, 0.3};
  room.registration_residual_mm = 0.8 * std::sqrt(3.0);

  EXPECT_NEAR(errors_of(room).shift_mm, 1.0, 1e-12);
  EXPECT_NEAR(errors_of(room).turn_rad, std::hypot(0.8 * 0.5, 0.3) * std::numbers::pi / 180, 1e-12);
}

TEST(RoomErrors, WhatIsStatedIsBelievedWhereNothingWasCheckedAndWhatIsNotIsDoubtedMoreThere) {
  RoomDescription room = a_room();
  EXPECT_GT(errors_of(room).unchecked_shift_mm, 1.5 * errors_of(room).shift_mm);
  EXPECT_GT(errors_of(room).unchecked_turn_rad, 1.5 * errors_of(room).turn_rad);
  EXPECT_GT(errors_of(room).unchecked_magnification, 1.5 * errors_of(room).magnification);

  room.cameras.front().pose_sigma_mm = {0.6, 0.6, 0.6};  // of the registration nothing is stated
  EXPECT_NEAR(errors_of(room).unchecked_shift_mm, std::hypot(RoomErrors().unchecked_shift_mm, 0.6), 1e-12);

  room.registration_residual_mm = 0.8 * std::sqrt(3.0);
  room.cameras.front().focal_sigma = 0.004;
  EXPECT_NEAR(errors_of(room).unchecked_shift_mm, 1.0, 1e-12);
  EXPECT_EQ(errors_of(room).unchecked_turn_rad, errors_of(room).turn_rad);
  EXPECT_EQ(errors_of(room).unchecked_magnification, 0.004);
}

TEST(RoomErrors, WhatLiesBetweenCoilsAndImagesIsSharedByRegistrationAndPosesAsTheyAreStated) {
  RoomDescription room = a_room();
  EXPECT_EQ(errors_of(room).pose_share_of_shift, 0.5) << "nothing is stated";
  EXPECT_EQ(errors_of(room).pose_share_of_turn, 0.5);

  room.cameras.front().pose_sigma_mm = {0.6, 0.6, 0.6};
  const double unchecked_mm = RoomErrors().unchecked_shift_mm;
  EXPECT_NEAR(errors_of(room).pose_share_of_shift, 0.36 / (0.36 + unchecked_mm * unchecked_mm), 1e-12);
  EXPECT_EQ(errors_of(room).pose_share_of_turn, 0.5) << "of the turn nothing is stated";

  room.registration_residual_mm = 0.8 * std::sqrt(3.0);
  EXPECT_NEAR(errors_of(room).pose_share_of_shift, 0.36, 1e-12);

  room.cameras.push_back(room.cameras.front());
  room.cameras.back().pose_sigma_mm.reset();
  EXPECT_GT(errors_of(room).pose_share_of_shift, 0.9) << "the other camera says nothing";
  room.cameras.back() = room.cameras.front();
  EXPECT_NEAR(errors_of(room).pose_share_of_shift, 0.72 / 1.36, 1e-12) << "any of the two";
}

TEST(RoomErrors, ASigmaCountsWhereAllStateOne) {
  RoomDescription room = a_room();
  room.instruments.front().coils[0].offset_sigma_mm = 0.3;
  EXPECT_EQ(errors_of(room).arc_length_mm, RoomErrors().arc_length_mm) << "the other coil says nothing";

  room.instruments.front().coils[1].offset_sigma_mm = 0.5;
  room.cameras.front().focal_sigma = 0.004;
  EXPECT_NEAR(errors_of(room).arc_length_mm, 0.5, 1e-12);
  EXPECT_NEAR(errors_of(room).magnification, 0.004, 1e-12);
}

}  // namespace
}  // namespace tubed
