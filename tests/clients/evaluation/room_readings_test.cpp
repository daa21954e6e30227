#include "clients/evaluation/room_readings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "clients/evaluation/recording_check.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

RigidTransform some_transform() {
  RigidTransform transform(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()));
  transform.translation() = Eigen::Vector3d(40, -90, 1300);
  return transform;
}

RoomDescription right_room() {
  RoomDescription room = one_view_room();
  room.T_world_em = some_transform();
  room.cameras.front().T_camera_world = some_transform();
  return room;
}

bool is_right(const RoomReading& reading) {
  const RoomDescription right = right_room();
  bool same = reading.room.T_world_em.isApprox(right.T_world_em, 1e-9);
  for (std::size_t i = 0; i < right.cameras.size(); ++i) {
    same = same && reading.room.cameras[i].T_camera_world.isApprox(right.cameras[i].T_camera_world, 1e-9);
  }
  return same;
}

/// The words of the reading that is the right room; "" when none is.
std::string right_reading_of(const RoomDescription& described) {
  for (const RoomReading& reading : other_readings(described)) {
    if (is_right(reading)) return reading.words;
  }
  return "";
}

TEST(RoomReadings, AnInverseIsOne) {
  RoomDescription room = right_room();
  room.T_world_em = room.T_world_em.inverse();
  EXPECT_EQ(right_reading_of(room), "with the inverse of T_world_em");
  room = right_room();
  room.cameras.front().T_camera_world = some_transform().inverse();
  EXPECT_EQ(right_reading_of(room), "with the inverse of T_camera_world");
}

// A half turn about the camera's x axis: what looked along z looks along -z.
TEST(RoomReadings, TheAxesOfComputerGraphicsAreOne) {
  const RigidTransform half_turn(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  RoomDescription room = right_room();
  room.cameras.front().T_camera_world = half_turn * some_transform();
  EXPECT_EQ(right_reading_of(room), "with cameras that look along -z");
  room.cameras.front().T_camera_world = (half_turn * some_transform()).inverse();
  EXPECT_EQ(right_reading_of(room), "with the inverse of T_camera_world, and cameras that look along -z");
}

TEST(RoomReadings, MetresAreOneWhereTheNumbersMayBeMetres) {
  RoomDescription room = right_room();
  room.T_world_em.translation() /= 1000;
  EXPECT_EQ(right_reading_of(room), "with T_world_em in metres");
  room = right_room();
  room.cameras.front().T_camera_world.translation() /= 1000;
  EXPECT_EQ(right_reading_of(room), "with T_camera_world in metres");
  const std::vector<RoomReading> readings = other_readings(right_room());
  EXPECT_TRUE(std::ranges::none_of(readings, [](const RoomReading& reading) {
    return reading.words.find("metres") != std::string::npos;
  }));
}

TEST(RoomReadings, TwoCamerasMayBeExchanged) {
  RoomDescription room = right_room();
  room.cameras.push_back(room.cameras.front());
  room.cameras[1].T_camera_world.translation().x() += 10;
  const std::vector<RoomReading> readings = other_readings(room);
  EXPECT_EQ(readings.back().words, "with the cameras exchanged");
  EXPECT_TRUE(readings.back().room.cameras[0].T_camera_world.isApprox(room.cameras[1].T_camera_world));
}

TEST(RoomReadings, WhatChangesNothingIsNone) {
  RoomDescription room = right_room();
  room.T_world_em = RigidTransform::Identity();
  room.cameras.clear();
  EXPECT_TRUE(other_readings(room).empty());
}

TEST(RecordingCheck, ACoilIsInViewWhereACameraSeesIt) {
  Sequence sequence;
  sequence.room = one_view_room();
  EXPECT_FALSE(is_any_coil_in_view(sequence)) << "without a measurement";
  const EmFrame frame = measure_coils(sequence.room, from_ns(0), 1, 1);
  SequenceMeasurement measurement;
  measurement.coil_count = frame.coil_count;
  measurement.coils = frame.coils;
  sequence.measurements.push_back(measurement);
  EXPECT_TRUE(is_any_coil_in_view(sequence));
  CameraCalibration& camera = sequence.room.cameras.front();
  camera.T_camera_world = camera.T_camera_world.inverse();
  EXPECT_FALSE(is_any_coil_in_view(sequence)) << "behind the camera";
  sequence.frames.emplace_back().geometry.emplace();
  EXPECT_TRUE(is_any_coil_in_view(sequence)) << "an image says how its view stood";
}

}  // namespace
}  // namespace tubed
