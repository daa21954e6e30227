// C-arms that turn, tables that pan and fields of view that change while a simulated catheter is watched.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "idl/geometry/camera.hpp"
#include "idl/geometry/view_geometry.hpp"

namespace tubed {

/// One move, linear in time; what it changed stays changed.
struct ViewMove {
  double from_s = 0;
  double until_s = 0;
  double turn_deg = 0;  ///< about the axis through the isocentre that is vertical in the image at rest
  double tilt_deg = 0;  ///< about the horizontal one
  Eigen::Vector3d pan_mm = Eigen::Vector3d::Zero();  ///< of the table, along the axes of the camera at rest
  double zoom = 1;                                   ///< by which focal lengths are multiplied
};

/// How one view moves, and what it says of that.
struct ViewMotion {
  std::vector<ViewMove> moves;
  double repeat_s = 0;         ///< these moves begin again after so long; 0: never
  std::vector<ViewMove> once;  ///< moves that happen once, beside the others
  double isocentre_mm = 1200;  ///< depth of the isocentre in the camera at rest
  bool announced = true;       ///< each image brings its geometry
  double noise_rad = 0;        ///< standard deviation of an announced pose's turn about each axis
  double noise_mm = 0;         ///< .. of its shift along each axis

  [[nodiscard]] bool moves_at_all() const { return !moves.empty() || !once.empty(); }
};

/// How the camera stands at `t_s`; that at rest before the first move, to the last bit.
ViewGeometry moved_view(const CameraCalibration& at_rest, const ViewMotion& motion, double t_s);

/// What an image of it says: nothing where nothing moves or nothing is announced, otherwise moved_view() with
/// the noise of exposure number `exposure` and its standard deviations.
std::optional<ViewGeometry> announced_view(const CameraCalibration& at_rest, const ViewMotion& motion,
                                           double t_s, std::int64_t exposure, std::int64_t seed);

/// The view with the table so far aside along the camera's x. Never allocates.
ViewGeometry panned_view(ViewGeometry view, double pan_mm);

/// A C-arm that swings by `turn_deg` at `speed_deg_s`, stays, swings back and stays, once in `period_s`.
std::vector<ViewMove> swing(double turn_deg, double speed_deg_s, double period_s);

/// What somebody does to a view once.
struct ViewChange {
  double pan_mm = 0;    ///< of the table, in the image's plane, in a direction drawn from the seed; 10 mm/s
  double turn_deg = 0;  ///< of the C-arm, as ViewMove has it; 10 deg/s
  double zoom = 1;      ///< of the field of view; within 0.1 s
  double at_s = 0;      ///< all begin then
};

/// Its moves; none where it changes nothing.
std::vector<ViewMove> moves_of(const ViewChange& change, std::int64_t seed);

}  // namespace tubed
