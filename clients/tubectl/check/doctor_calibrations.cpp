#include "clients/tubectl/check/doctor_calibrations.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "daemon/estimator/agreement/room_errors.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

Finding registration_of(const RoomDescription& room) {
  if (room.registration_quality || room.registration_residual_mm) {
    return {Verdict::kGood, "how well the registration is known is stated", ""};
  }
  const RoomErrors unstated;
  return {
      Verdict::kNote,
      fmt::format("how well the registration is known is not stated: sigma has {:.1f} mm and {:.0f} degree "
                  "of it in every direction that no image checks, such as the depth of a single view",
                  unstated.unchecked_shift_mm, unstated.unchecked_turn_rad / kDegree),
      "`tubectl register` and `tubectl calibrate registration` write it with the registration"};
}

Finding poses_of(const RoomDescription& room) {
  const auto unstated = std::ranges::find_if(room.cameras, [](const CameraCalibration& camera) {
    return !camera.pose_sigma_mm || !camera.pose_sigma_deg;
  });
  if (unstated == room.cameras.end()) {
    return {Verdict::kGood, "how well the cameras' poses are known is stated", ""};
  }
  return {
      Verdict::kNote,
      fmt::format("how well the pose of camera {} is known is not stated: where coils and images lie apart "
                  "it is as likely as the registration, and sigma reaches from the one to the other",
                  unstated->name),
      "`tubectl calibrate camera` writes it as pose_sigma_mm and pose_sigma_deg"};
}

Finding focal_length_of(const RoomDescription& room) {
  const auto unstated = std::ranges::find_if(
      room.cameras, [](const CameraCalibration& camera) { return !camera.focal_sigma.has_value(); });
  if (unstated == room.cameras.end()) {
    return {Verdict::kGood, "how well focal lengths are known is stated", ""};
  }
  return {
      Verdict::kNote,
      fmt::format("how well the focal length of camera {} is known is not stated: sigma at the sides of a "
                  "view has {:.0f} % of the way from its middle",
                  unstated->name, 100 * RoomErrors().unchecked_magnification),
      "`tubectl calibrate camera` writes it as focal_sigma"};
}

}  // namespace

std::vector<NamedFinding> examine_calibrations(const Configuration& configuration) {
  const RoomDescription& room = configuration.room;
  if (!room.registered || room.cameras.empty()) return {};
  return {{"registration", registration_of(room)},
          {"camera pose", poses_of(room)},
          {"focal length", focal_length_of(room)}};
}

}  // namespace tubed
