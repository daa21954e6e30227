// The arc of simulated_tube.hpp with a hook at its tip, for the tests of pre-shaped instruments.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "drivers/interface/rest_curve.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {

/// A circle over the last `length_mm` of the arc, toward a direction of `roll_rad` about the arc's tangent.
struct HookedTube {
  double radius_mm = 8;
  double length_mm = 14;
  double roll_rad = 0;
  std::vector<RestArc> arcs{};  ///< instead of the circle, as long together

  [[nodiscard]] RestCurve curve() const {
    return arcs.empty() ? RestCurve::hook(radius_mm, length_mm) : RestCurve{arcs};
  }

  [[nodiscard]] Eigen::Vector3d toward() const {
    const Eigen::Vector3d t = arc_tangent_to_tip(length_mm);
    const Eigen::Vector3d across = t.cross(Eigen::Vector3d::UnitZ()).normalized();  // in the view
    return std::cos(roll_rad) * across + std::sin(roll_rad) * t.cross(across);
  }
  /// Of the plane, as RestHook has it: zeta runs from the tip away, so that zeta'' = kappa b x zeta'.
  [[nodiscard]] Eigen::Vector3d binormal() const {
    return arc_tangent_to_tip(length_mm).cross(toward()) * -1;
  }
  [[nodiscard]] Eigen::Vector3d point(double s_mm) const {
    if (s_mm >= length_mm) return arc_point(s_mm);
    Eigen::Vector3d at = arc_point(length_mm);
    Eigen::Vector3d ahead = arc_tangent_to_tip(length_mm);
    Eigen::Vector3d aside = toward();
    double left_mm = length_mm - s_mm;
    const RestCurve whole = curve();
    for (auto arc = whole.arcs.rbegin(); arc != whole.arcs.rend() && left_mm > 0; ++arc) {
      const double go_mm = arc + 1 == whole.arcs.rend() ? left_mm : std::min(left_mm, arc->length_mm);
      const double angle = go_mm * arc->curvature_per_mm();
      at += arc->radius_mm == 0
                ? Eigen::Vector3d(go_mm * ahead)
                : Eigen::Vector3d(arc->radius_mm * (std::sin(angle) * ahead + (1 - std::cos(angle)) * aside));
      const Eigen::Vector3d turned = std::cos(angle) * ahead + std::sin(angle) * aside;
      aside = std::cos(angle) * aside - std::sin(angle) * ahead;
      ahead = turned;
      left_mm -= go_mm;
    }
    return at;
  }
  [[nodiscard]] Eigen::Vector3d tangent_to_tip(double s_mm) const {
    return (point(s_mm - 1e-4) - point(s_mm + 1e-4)).normalized();
  }
};

/// The room of Sec. 3.1 with the first coil elsewhere.
inline RoomDescription room_with_first_coil(double offset_mm) {
  RoomDescription room = one_view_room();
  room.instruments.front().coils.front().offset_from_tip_mm = offset_mm;
  return room;
}

/// A measurement of all coils on the tube with Gaussian errors.
inline EmFrame measure_hooked(const HookedTube& tube, const RoomDescription& room, MonotonicTime time,
                              double sigma_mm, double sigma_tangent, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  EmFrame frame;
  frame.measured = frame.received = time;
  frame.tracker_frame = seed;
  frame.origin = Origin::kSimulated;
  for (const CoilPlacement& coil : room.instruments.front().coils) {
    CoilSample& sample = frame.coils[static_cast<std::size_t>(frame.coil_count++)];
    sample.status = CoilStatus::kOk;
    sample.p_em_mm = tube.point(coil.offset_from_tip_mm) + sigma_mm * vector();
    sample.tangent_em =
        (tube.tangent_to_tip(coil.offset_from_tip_mm) + sigma_tangent * vector()).normalized();
  }
  return frame;
}

/// As image_of_arc().
inline ImageMeasurement image_of_hooked(const HookedTube& tube, const RoomDescription& room,
                                        MonotonicTime exposure, std::size_t view = 0) {
  ImageMeasurement image = image_of_arc(room, exposure, {-1, tube.length_mm}, view);
  const Camera camera(room.cameras[view]);
  for (double s = 0; s <= tube.length_mm; s += 0.25) {
    draw_ridge(camera, tube.point(s), 0.9, image);
  }
  return image;
}

}  // namespace tubed
