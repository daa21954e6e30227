// How far what a room is described by may be off, by what its calibrations say of themselves.
#pragma once

#include <numbers>

#include "drivers/interface/room.hpp"

namespace tubed {

/// Standard deviations of what stays wrong in a room that is described rightly. The defaults are those of a
/// room that says nothing of itself.
struct RoomErrors {
  double shift_mm = 1.0;                           ///< of the registration and the cameras' poses, an axis
  double turn_rad = 0.5 * std::numbers::pi / 180;  ///< of the same, about each axis
  double arc_length_mm = 1.0;                      ///< of arc lengths, that all coils share
  double clock_s = 0.015;                          ///< of images' stamps against the coils'
  double magnification = 0.01;                     ///< of a view, relative
  double coil_mm = 0.5;                            ///< of each coil, at least, an axis

  // What is published of a direction in which nothing was compared yet, such as the depth of a single view:
  // there a mistake would go unnoticed, and 3 sigma of a room that says nothing of itself are 7.5 mm and
  // 3 degrees, 6 % of a view. Where a calibration states how good it is, what it states.
  double unchecked_shift_mm = 2.5;
  double unchecked_turn_rad = 1.0 * std::numbers::pi / 180;
  double unchecked_magnification = 0.02;

  // What lies between coils and images across a view may be the registration's error or the pose's of the
  // camera: the share of its variance that is the poses', of all cameras.
  double pose_share_of_shift = 0.5;
  double pose_share_of_turn = 0.5;
};

/// Those of `room` for one of its instruments. The registration's come from its covariance, at the place that
/// the first camera looks at; without one from its residual, which for markers of a body is about sqrt(3)
/// times the error of an axis; cameras add the variances of their poses. Arc lengths,
/// magnification and the clock have the greatest sigma that is stated, where all coils, all cameras, state
/// one. Shares of poses are of what is stated, and of what was never checked where nothing is. None is below
/// a fifth of the default: what no calibration knows of, such as a table that sags, stays.
RoomErrors room_errors(const RoomDescription& room, const InstrumentDescription& instrument);

}  // namespace tubed
