#include "clients/evaluation/room_readings.hpp"

#include <utility>

namespace tubed {

namespace {

constexpr double kMax_m = 10;   // a translation that is longer is not in metres
constexpr double kSame = 1e-6;  // relative difference of two transforms that are one
constexpr double kMillimetresInMetre = 1000;

/// Where all cameras stand after `change`.
template <typename Change>
RoomDescription with_cameras(RoomDescription room, const Change& change) {
  for (CameraCalibration& camera : room.cameras) camera.T_camera_world = change(camera.T_camera_world);
  return room;
}

RoomDescription with_registration(RoomDescription room, const RigidTransform& T_world_em) {
  room.T_world_em = T_world_em;
  return room;
}

RigidTransform in_millimetres(RigidTransform metres) {
  metres.translation() *= kMillimetresInMetre;
  return metres;
}

bool may_be_metres(const RigidTransform& transform) {
  const double length_m = transform.translation().norm();
  return length_m > 0 && length_m < kMax_m;
}

/// Of a camera that looks along -z, with y up.
RigidTransform from_graphics(const RigidTransform& T_camera_world) {
  return RigidTransform(Eigen::DiagonalMatrix<double, 3>(1, -1, -1)) * T_camera_world;
}

bool are_the_same(const RoomDescription& a, const RoomDescription& b) {
  bool same = a.T_world_em.isApprox(b.T_world_em, kSame);
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    same = same && a.cameras[i].T_camera_world.isApprox(b.cameras[i].T_camera_world, kSame);
  }
  return same;
}

}  // namespace

std::vector<RoomReading> other_readings(const RoomDescription& room) {
  std::vector<RoomReading> readings;
  const auto add = [&](std::string words, std::string advice, RoomDescription other) {
    if (!are_the_same(room, other)) {
      readings.push_back({std::move(words), std::move(advice), std::move(other)});
    }
  };
  const auto inverse = [](const RigidTransform& transform) { return transform.inverse(); };
  add("with the inverse of T_world_em",
      "T_world_em takes what the tracker measures to the world: configure the inverse of what is there",
      with_registration(room, room.T_world_em.inverse()));
  add("with the inverse of T_camera_world",
      "T_camera_world takes the world to the camera: configure the inverse of what is there",
      with_cameras(room, inverse));
  const std::string axes =
      "the camera's z axis points along its rays into the scene, x and y along the image's columns and "
      "rows: turn T_camera_world by 180 degrees about x";
  add("with cameras that look along -z", axes, with_cameras(room, from_graphics));
  add("with the inverse of T_camera_world, and cameras that look along -z",
      "configure the inverse, and " + axes,
      with_cameras(room, [&](const RigidTransform& transform) { return from_graphics(inverse(transform)); }));
  if (may_be_metres(room.T_world_em)) {
    add("with T_world_em in metres", "the translation of T_world_em is in millimetres: multiply it by 1000",
        with_registration(room, in_millimetres(room.T_world_em)));
  }
  if (!room.cameras.empty() && may_be_metres(room.cameras.front().T_camera_world)) {
    add("with T_camera_world in metres",
        "the translation of T_camera_world is in millimetres: multiply it by 1000",
        with_cameras(room, in_millimetres));
  }
  if (room.cameras.size() == 2) {
    RoomDescription other = room;
    std::swap(other.cameras[0].T_camera_world, other.cameras[1].T_camera_world);
    add("with the cameras exchanged", "exchange T_camera_world of the two cameras, or their names",
        std::move(other));
  }
  return readings;
}

}  // namespace tubed
