// Curves with closed forms, coils on them and images of them, for the tests of the estimator.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <random>

#include "daemon/estimator/coils/em_history.hpp"
#include "daemon/image/image_measurement.hpp"
#include "drivers/interface/room.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// A circle's arc of radius 120 mm in x-y with a gentle slope in z; arc length from the tip, unit speed.
inline Eigen::Vector3d arc_point(double s_mm) {
  constexpr double kRadius = 120;
  constexpr double kSlope = 0.2;
  const double flat = s_mm * std::sqrt(1 - kSlope * kSlope) / kRadius;
  return {kRadius * std::sin(flat) - 60, 60 - kRadius * std::cos(flat), kSlope * s_mm - 30};
}

inline Eigen::Vector3d arc_tangent_to_tip(double s_mm) {
  return (arc_point(s_mm - 1e-4) - arc_point(s_mm + 1e-4)).normalized();
}

/// Five coils as in Sec. 3.1 and one camera as there.
/// Of a room whose registration is as good as any.
inline RoomDescription well_registered(RoomDescription room) {
  room.registration_residual_mm = 0;
  return room;
}

inline RoomDescription one_view_room() {
  RoomDescription room;
  CameraCalibration camera;
  camera.name = "A";
  camera.width = 400;
  camera.height = 600;
  camera.fx = camera.fy = 2000;
  camera.cx = 200;
  camera.cy = 300;
  camera.T_camera_world.translation() = Eigen::Vector3d(0, 0, 1200);
  room.cameras = {camera};
  InstrumentDescription instrument;
  instrument.id = "cath-1";
  instrument.length_mm = 380;
  for (const double offset : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    instrument.coils.push_back({static_cast<int>(instrument.coils.size()) + 1, offset, false});
  }
  room.instruments = {instrument};
  return room;
}

/// A measurement of all coils at `time`, displaced by `amplitude_mm` in a random direction each.
inline EmFrame measure_coils(const RoomDescription& room, MonotonicTime time, double amplitude_mm,
                             unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  EmFrame frame;
  frame.measured = frame.received = time;
  frame.tracker_frame = seed;
  frame.origin = Origin::kSimulated;
  for (const CoilPlacement& coil : room.instruments.front().coils) {
    CoilSample& sample = frame.coils[static_cast<std::size_t>(frame.coil_count++)];
    const Eigen::Vector3d direction(normal(random), normal(random), normal(random));
    sample.status = CoilStatus::kOk;
    sample.p_em_mm = arc_point(coil.offset_from_tip_mm) + amplitude_mm * direction.normalized();
    sample.tangent_em = arc_tangent_to_tip(coil.offset_from_tip_mm);
  }
  return frame;
}

/// Draws a ridge of 2 px and `height` into the vesselness around the projection of `p_world_mm`.
inline void draw_ridge(const Camera& camera, const Eigen::Vector3d& p_world_mm, double height,
                       ImageMeasurement& image) {
  const auto p = camera.project(p_world_mm);
  if (!p || !camera.contains(p->p_image_px, 8)) {
    return;
  }
  for (int dy = -6; dy <= 6; ++dy) {
    for (int dx = -6; dx <= 6; ++dx) {
      const int x = static_cast<int>(std::lround(p->p_image_px.x())) + dx;
      const int y = static_cast<int>(std::lround(p->p_image_px.y())) + dy;
      const double d2 = (Eigen::Vector2d(x, y) - p->p_image_px).squaredNorm();
      float& v = image.vesselness[static_cast<std::size_t>(y * image.width + x)];
      v = std::max(v, static_cast<float>(height * std::exp(-0.5 * d2 / 4)));
    }
  }
}

/// A stretch of arc length.
struct Stretch {
  double from_mm = 0;
  double to_mm = 0;
  [[nodiscard]] bool contains(double s_mm) const { return s_mm > from_mm && s_mm < to_mm; }
};

/// The vesselness that a perfect filter would give: a ridge of 2 px along the projected arc, but for
/// `hidden`.
inline ImageMeasurement image_of_arc(const RoomDescription& room, MonotonicTime exposure,
                                     const Stretch& hidden = {}, std::size_t view = 0) {
  const Camera camera(room.cameras[view]);
  ImageMeasurement image;
  image.camera = static_cast<int>(view);
  image.reserve(room.cameras[view].width, room.cameras[view].height);
  image.state = ImageState::kMeasured;
  image.exposure = exposure;
  image.origin = Origin::kSimulated;
  for (double s = 0; s <= 380; s += 0.25) {
    if (!hidden.contains(s)) {
      draw_ridge(camera, arc_point(s), 0.9, image);
    }
  }
  return image;
}

}  // namespace tubed
