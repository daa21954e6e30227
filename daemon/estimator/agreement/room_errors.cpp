#include "daemon/estimator/agreement/room_errors.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kMinShare = 0.2;  // of a default
constexpr double kMaxShare = 5;    // a calibration that knows less than that was none
constexpr double kRadians = std::numbers::pi / 180;

double mean_square(const Eigen::Vector3d& sigma) { return sigma.squaredNorm() / 3; }

double bounded(double sigma, double usual) { return std::clamp(sigma, kMinShare * usual, kMaxShare * usual); }

/// Mean variances of a shift and of a turn over the three axes.
struct MotionVariance {
  double shift_mm2 = 0;
  double turn_rad2 = 0;
};

Eigen::Vector3d looked_at(const RoomDescription& room, const RegistrationQuality& quality) {
  const auto place = room.cameras.empty() ? std::nullopt : room.cameras.front().looked_at_world_mm();
  return place.value_or(quality.centre_world_mm);
}

std::optional<MotionVariance> of_registration(const RoomDescription& room) {
  if (room.registration_quality) {
    const auto sigma = room.registration_quality->sigma_at(looked_at(room, *room.registration_quality));
    return MotionVariance{mean_square(sigma.shift_mm), mean_square(sigma.turn_rad)};
  }
  if (room.registration_residual_mm) {
    // The turn as the defaults have it to the shift.
    const RoomErrors usual;
    const double shift_mm = *room.registration_residual_mm / std::sqrt(3.0);
    const double turn_rad = usual.turn_rad * shift_mm / usual.shift_mm;
    return MotionVariance{shift_mm * shift_mm, turn_rad * turn_rad};
  }
  return {};
}

/// Of the view whose pose is known worst.
MotionVariance of_poses(const std::vector<CameraCalibration>& cameras) {
  MotionVariance greatest;
  for (const CameraCalibration& camera : cameras) {
    if (camera.pose_sigma_mm) {
      const Eigen::Vector3d sigma_mm(camera.pose_sigma_mm->data());
      greatest.shift_mm2 = std::max(greatest.shift_mm2, mean_square(sigma_mm));
    }
    if (camera.pose_sigma_deg) {
      const Eigen::Vector3d sigma_deg(camera.pose_sigma_deg->data());
      greatest.turn_rad2 = std::max(greatest.turn_rad2, mean_square(sigma_deg * kRadians));
    }
  }
  return greatest;
}

/// The greatest of a sigma that every one of `list` states; nothing when one does not, or the list is empty.
template <typename Item>
std::optional<double> max_stated(const std::vector<Item>& list, std::optional<double> Item::*sigma) {
  std::optional<double> greatest;
  for (const Item& item : list) {
    if (!(item.*sigma)) {
      return {};
    }
    greatest = std::max(greatest.value_or(0), *(item.*sigma));
  }
  return greatest;
}

double bounded_or_usual(std::optional<double> sigma, double usual) {
  return sigma ? bounded(*sigma, usual) : usual;
}

/// Of what is the sum of both errors, the variance of the first against that of both.
double share_of(double sigma, double other_sigma) {
  return squared(sigma) / (squared(sigma) + squared(other_sigma));
}

/// Shares of the cameras' poses in what lies between coils and images.
void share_with_poses(const RoomDescription& room, const MotionVariance& poses,
                      const std::optional<MotionVariance>& registration, RoomErrors& errors) {
  const RoomErrors usual;
  const auto all_state = [&room](const auto& sigma) { return std::ranges::all_of(room.cameras, sigma); };
  const double pose_mm = all_state([](const auto& camera) { return camera.pose_sigma_mm.has_value(); })
                             ? bounded(std::sqrt(poses.shift_mm2), usual.shift_mm)
                             : usual.unchecked_shift_mm;
  const double pose_rad = all_state([](const auto& camera) { return camera.pose_sigma_deg.has_value(); })
                              ? bounded(std::sqrt(poses.turn_rad2), usual.turn_rad)
                              : usual.unchecked_turn_rad;
  const double shift_mm =
      registration ? bounded(std::sqrt(registration->shift_mm2), usual.shift_mm) : usual.unchecked_shift_mm;
  const double turn_rad =
      registration ? bounded(std::sqrt(registration->turn_rad2), usual.turn_rad) : usual.unchecked_turn_rad;
  const double any = std::sqrt(static_cast<double>(std::max<std::size_t>(room.cameras.size(), 1)));
  errors.pose_share_of_shift = share_of(any * pose_mm, shift_mm);
  errors.pose_share_of_turn = share_of(any * pose_rad, turn_rad);
}

}  // namespace

RoomErrors room_errors(const RoomDescription& room, const InstrumentDescription& instrument) {
  const RoomErrors usual;
  RoomErrors errors;
  const MotionVariance poses = of_poses(room.cameras);
  const auto registration = of_registration(room);
  const bool is_stated = registration || poses.shift_mm2 > 0 || poses.turn_rad2 > 0;
  if (is_stated) {
    const auto with_poses = [&](double shift_mm, double turn_rad) {
      const MotionVariance known =
          registration.value_or(MotionVariance{squared(shift_mm), squared(turn_rad)});
      return std::pair(bounded(std::sqrt(known.shift_mm2 + poses.shift_mm2), usual.shift_mm),
                       bounded(std::sqrt(known.turn_rad2 + poses.turn_rad2), usual.turn_rad));
    };
    std::tie(errors.shift_mm, errors.turn_rad) = with_poses(usual.shift_mm, usual.turn_rad);
    std::tie(errors.unchecked_shift_mm, errors.unchecked_turn_rad) =
        with_poses(usual.unchecked_shift_mm, usual.unchecked_turn_rad);
  }
  share_with_poses(room, poses, registration, errors);
  errors.arc_length_mm =
      bounded_or_usual(max_stated(instrument.coils, &CoilPlacement::offset_sigma_mm), usual.arc_length_mm);
  errors.clock_s = 1e-3 * bounded_or_usual(max_stated(room.cameras, &CameraCalibration::time_offset_sigma_ms),
                                           1e3 * usual.clock_s);
  const auto focal = max_stated(room.cameras, &CameraCalibration::focal_sigma);
  if (focal) {
    errors.magnification = errors.unchecked_magnification = bounded(*focal, usual.magnification);
  }
  return errors;
}

}  // namespace tubed
