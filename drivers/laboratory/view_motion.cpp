#include "drivers/laboratory/view_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/laboratory/random/counter_random.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kNoiseStream = 4100;
constexpr std::int64_t kPanStream = 4200;

/// What all moves together have changed.
ViewMove changed_by(const ViewMotion& motion, double t_s) {
  ViewMove sum;
  const auto add = [&sum](const ViewMove& move, double time_s) {
    const double duration_s = std::max(move.until_s - move.from_s, 1e-9);
    const double part = std::clamp((time_s - move.from_s) / duration_s, 0.0, 1.0);
    sum.turn_deg += part * move.turn_deg;
    sum.tilt_deg += part * move.tilt_deg;
    sum.pan_mm += part * move.pan_mm;
    sum.zoom *= 1 + part * (move.zoom - 1);
  };
  const double repeated_s = motion.repeat_s > 0 ? std::fmod(std::max(t_s, 0.0), motion.repeat_s) : t_s;
  for (const ViewMove& move : motion.moves) add(move, repeated_s);
  for (const ViewMove& move : motion.once) add(move, t_s);
  return sum;
}

ViewGeometry with_pose(ViewGeometry geometry, const RigidTransform& T_camera_world) {
  const Eigen::Quaterniond q(T_camera_world.linear());
  const Eigen::Vector3d t_mm = T_camera_world.translation();
  geometry.q_camera_world = {q.w(), q.x(), q.y(), q.z()};
  geometry.t_camera_world_mm = {t_mm.x(), t_mm.y(), t_mm.z()};
  return geometry;
}

/// A standard normal deviate, Box-Muller.
double normal(CounterRandom& random) {
  const double radius = std::sqrt(-2 * std::log(1 - random.unit()));
  return radius * std::cos(2 * std::numbers::pi * random.unit());
}

Eigen::Vector3d normals(CounterRandom& random, double sigma) {
  const double x = normal(random);
  const double y = normal(random);
  const double z = normal(random);
  return sigma * Eigen::Vector3d(x, y, z);
}

}  // namespace

ViewGeometry moved_view(const CameraCalibration& at_rest, const ViewMotion& motion, double t_s) {
  ViewGeometry geometry = geometry_of(at_rest);
  const ViewMove change = changed_by(motion, t_s);
  const bool is_at_rest = change.turn_deg == 0 && change.tilt_deg == 0 && change.pan_mm.isZero(0);
  geometry.fx *= change.zoom;
  geometry.fy *= change.zoom;
  if (is_at_rest) {
    return geometry;
  }
  const Eigen::Translation3d isocentre(0, 0, motion.isocentre_mm);
  const RigidTransform moved =
      isocentre * Eigen::AngleAxisd(change.turn_deg * kDegree, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(change.tilt_deg * kDegree, Eigen::Vector3d::UnitX()) * isocentre.inverse() *
      Eigen::Translation3d(change.pan_mm) * at_rest.T_camera_world;
  return with_pose(geometry, moved);
}

std::optional<ViewGeometry> announced_view(const CameraCalibration& at_rest, const ViewMotion& motion,
                                           double t_s, std::int64_t exposure, std::int64_t seed) {
  if (!motion.moves_at_all() || !motion.announced) {
    return std::nullopt;
  }
  ViewGeometry view = moved_view(at_rest, motion, t_s);
  if (motion.noise_rad == 0 && motion.noise_mm == 0) {
    return view;
  }
  CounterRandom random(seed, kNoiseStream, exposure);
  const Eigen::Vector3d turn_rad = normals(random, motion.noise_rad);
  const Eigen::Vector3d shift_mm = normals(random, motion.noise_mm);
  const Eigen::Translation3d isocentre(0, 0, motion.isocentre_mm);
  const double angle_rad = turn_rad.norm();
  const Eigen::AngleAxisd turn(angle_rad, angle_rad > 0 ? Eigen::Vector3d(turn_rad / angle_rad)
                                                        : Eigen::Vector3d(Eigen::Vector3d::UnitX()));
  view = with_pose(
      view, isocentre * turn * isocentre.inverse() * Eigen::Translation3d(shift_mm) * view.T_camera_world());
  view.sigma.rotation_rad.fill(motion.noise_rad);
  view.sigma.translation_mm.fill(motion.noise_mm);
  view.sigma.pivot_depth_mm = motion.isocentre_mm;
  return view;
}

ViewGeometry panned_view(ViewGeometry view, double pan_mm) {
  view.t_camera_world_mm[0] += pan_mm;
  return view;
}

std::vector<ViewMove> swing(double turn_deg, double speed_deg_s, double period_s) {
  const double duration_s = std::min(std::abs(turn_deg) / speed_deg_s, period_s / 2);
  ViewMove there;
  there.until_s = duration_s;
  there.turn_deg = turn_deg;
  ViewMove back = there;
  back.from_s = period_s / 2;
  back.until_s = period_s / 2 + duration_s;
  back.turn_deg = -turn_deg;
  return {there, back};
}

std::vector<ViewMove> moves_of(const ViewChange& change, std::int64_t seed) {
  constexpr double kPan_mm_s = 10;
  constexpr double kTurn_deg_s = 10;
  constexpr double kZoom_s = 0.1;
  std::vector<ViewMove> moves;
  const auto begin = [&](double duration_s) -> ViewMove& {
    ViewMove move;
    move.from_s = change.at_s;
    move.until_s = change.at_s + duration_s;
    return moves.emplace_back(move);
  };
  if (change.pan_mm != 0) {
    const double direction_rad = 2 * std::numbers::pi * CounterRandom(seed, kPanStream, 0).unit();
    begin(std::abs(change.pan_mm) / kPan_mm_s).pan_mm =
        change.pan_mm * Eigen::Vector3d(std::cos(direction_rad), std::sin(direction_rad), 0);
  }
  if (change.turn_deg != 0) {
    begin(std::abs(change.turn_deg) / kTurn_deg_s).turn_deg = change.turn_deg;
  }
  if (change.zoom != 1) {
    begin(kZoom_s).zoom = change.zoom;
  }
  return moves;
}

}  // namespace tubed
