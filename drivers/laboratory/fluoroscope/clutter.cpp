#include "drivers/laboratory/fluoroscope/clutter.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

#include "drivers/laboratory/fluoroscope/contrast_agent.hpp"
#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"

namespace tubed {

namespace {

using Eigen::Vector3d;

constexpr double kSteel_per_mm = 0.60;

/// Smooth through `points`, about every mm (centripetal enough for evenly set points: Catmull-Rom).
Eigen::Matrix3Xd smooth_course(const Eigen::Matrix3Xd& points) {
  std::vector<Vector3d> course;
  const Eigen::Index last = points.cols() - 1;
  for (Eigen::Index i = 0; i < last; ++i) {
    const Vector3d a = points.col(std::max<Eigen::Index>(i - 1, 0));
    const Vector3d b = points.col(i);
    const Vector3d c = points.col(i + 1);
    const Vector3d d = points.col(std::min(i + 2, last));
    const int steps = std::max(1, static_cast<int>(std::lround((c - b).norm())));
    for (int step = 0; step < steps; ++step) {
      const double t = static_cast<double>(step) / steps;
      course.push_back(b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))));
    }
  }
  course.push_back(points.col(last));
  Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(course.size()));
  for (std::size_t i = 0; i < course.size(); ++i) {
    matrix.col(static_cast<Eigen::Index>(i)) = course[i];
  }
  return matrix;
}

RadiographRod wire(std::initializer_list<Vector3d> points, double radius_mm, double attenuation_per_mm) {
  Eigen::Matrix3Xd course(3, static_cast<Eigen::Index>(points.size()));
  std::copy_n(points.begin(), points.size(), course.colwise().begin());
  RadiographRod rod;
  rod.centreline_room_mm = smooth_course(course);
  rod.radius_mm = radius_mm;
  rod.lumen_radius_mm = 0;
  rod.attenuation_per_mm = attenuation_per_mm;
  return rod;
}

/// A lead with the metal clip of its electrode on the skin.
RadiographRod lead(std::initializer_list<Vector3d> points) {
  RadiographRod rod = wire(points, 0.55, 0.35);
  RadiographElectrode clip;
  clip.s_mm = 3;
  clip.length_mm = 6;
  clip.radius_mm = 3.2;
  clip.wall_mm = 0.9;
  clip.attenuation_per_mm = 0.45;
  rod.electrodes.push_back(clip);
  return rod;
}

/// Round the sternum at height z, its ends twisted together in front.
void add_sternal_wire(double z, std::vector<RadiographRod>& rods) {
  const anatomy::CrossSection cage = anatomy::rib_cage(z);
  const Vector3d middle(cage.x, cage.y - cage.half_depth - 5, z);
  constexpr double kHalfWidth_mm = 15;
  constexpr double kHalfDepth_mm = 7;
  constexpr int kPoints = 24;
  RadiographRod loop;
  loop.centreline_room_mm.resize(3, kPoints + 1);
  for (int i = 0; i <= kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    // The two sides lie a little apart in height: the loop is not seen as a line from anywhere.
    loop.centreline_room_mm.col(i) = middle + Vector3d(kHalfWidth_mm * std::sin(angle),
                                                       -kHalfDepth_mm * std::cos(angle), 3 * std::sin(angle));
  }
  loop.radius_mm = 0.4;
  loop.lumen_radius_mm = 0;
  loop.attenuation_per_mm = kSteel_per_mm;
  const Vector3d front = middle - Vector3d(0, kHalfDepth_mm, 0);
  rods.push_back(wire({front, front + Vector3d(3, -1, 5), front + Vector3d(5, -1, 9)}, 0.6, kSteel_per_mm));
  rods.push_back(std::move(loop));
}

}  // namespace

void add_surgery(RadiographSettings& settings) {
  settings.surgery.clear();
  for (const double z : {14.0, -6.0, -30.0, -52.0, -74.0, -96.0}) {
    add_sternal_wire(z, settings.surgery);
  }
  for (int i = 0; i < 8; ++i) {
    const Vector3d place(24 + 4.0 * (i % 3), -84 + 3.0 * (i % 2), -8 - 13.0 * i);
    const Vector3d along(i % 2 == 0 ? 2.5 : -1.5, 1, i % 3 == 0 ? 2 : -2.5);
    settings.surgery.push_back(wire({place - along, place + along}, 0.5, kSteel_per_mm));
  }
  // Through the superior vena cava to the right ventricle; its coil is wound of wire, 50 mm long.
  RadiographRod lead = wire({{24, -88, -130},
                             {2, -82, -124},
                             {-26, -66, -112},
                             {-44, -48, -84},
                             {-46, -36, -40},
                             {-43, -26, 10},
                             {-42, -24, 66},
                             {-58, -26, 108},
                             {-84, -26, 140}},
                            0.9, 0.25);
  RadiographElectrode coil;
  coil.s_mm = 40;
  coil.length_mm = 50;
  coil.radius_mm = 1.3;
  coil.wall_mm = 0.15;
  coil.attenuation_per_mm = 4;
  lead.electrodes.push_back(coil);
  settings.surgery.push_back(std::move(lead));
}

void add_default_clutter(RadiographSettings& settings) {
  settings.second_wire.clear();
  // A guide wire, 0.035 inch: up the descending aorta, its floppy end curled in the arch.
  settings.second_wire.push_back(wire({{-12, -6, 22},
                                       {-4, 2, 36},
                                       {10, 12, 33},
                                       {20, 18, 18},
                                       {25, 21, -8},
                                       {18, 8, -60},
                                       {2, -4, -110},
                                       {-14, -20, -180},
                                       {-26, -36, -260},
                                       {-22, -44, -340},
                                       {-30, -44, -400}},
                                      0.44, kSteel_per_mm));
  // A pacing lead: through the superior vena cava to the apex of the right ventricle.
  RadiographRod pacing = wire({{30, -84, -128},
                               {10, -80, -126},
                               {-22, -66, -116},
                               {-42, -50, -92},
                               {-45, -38, -50},
                               {-42, -26, 0},
                               {-38, -22, 60},
                               {-46, -24, 100},
                               {-70, -24, 140}},
                              0.75, 0.22);
  for (const double s_mm : {1.0, 12.0}) {
    RadiographElectrode ring;
    ring.s_mm = s_mm;
    ring.length_mm = 2;
    ring.radius_mm = 0.95;
    pacing.electrodes.push_back(ring);
  }
  settings.second_wire.push_back(pacing);
  settings.ecg_leads = {
      lead({{62, -118, 38}, {74, -116, 10}, {70, -120, -60}, {84, -114, -150}, {96, -112, -300}}),
      lead({{-92, -104, 24}, {-96, -106, -10}, {-70, -122, -70}, {-66, -124, -180}, {-40, -130, -320}}),
      lead({{98, -96, -152}, {110, -86, -170}, {118, -80, -230}, {112, -90, -320}})};
}

void add_lumen(RadiographSettings& settings, const VesselCourse& aorta) {
  const Eigen::Index count = aorta.radius_mm.size();
  Eigen::Matrix3Xd upstream(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    upstream.col(i) = aorta.centreline_room_mm.col(count - 1 - i);
  }
  const Eigen::Matrix3Xd course = count > 1 ? smooth_course(upstream) : upstream;
  const Eigen::VectorXd coarse_mm = arc_lengths_mm(upstream);
  // Every third point: the lumen is wide and bends gently.
  const Eigen::Index kept = (course.cols() + 2) / 3;
  settings.lumen.centreline_room_mm.resize(3, kept);
  settings.lumen.radius_mm.resize(kept);
  const Eigen::VectorXd fine_mm = arc_lengths_mm(course);
  for (Eigen::Index i = 0; i < kept; ++i) {
    settings.lumen.centreline_room_mm.col(i) = course.col(3 * i);
    Eigen::Index at = 0;
    while (at + 2 < count && coarse_mm[at + 1] < fine_mm[3 * i]) {
      ++at;
    }
    const double part =
        count > 1
            ? std::clamp((fine_mm[3 * i] - coarse_mm[at]) / (coarse_mm[at + 1] - coarse_mm[at]), 0.0, 1.0)
            : 0.0;
    settings.lumen.radius_mm[i] =
        aorta.radius_mm[count - 1 - at] +
        part * (aorta.radius_mm[count - 1 - std::min(at + 1, count - 1)] - aorta.radius_mm[count - 1 - at]);
  }
}

void add_motion(RadiographSettings& settings) {
  settings.motion.heart_phases = 4;
  settings.motion.breathing_phases = 8;
}

RadiographRod catheter_along(const VesselCourse& vessel, double from_end_mm) {
  const Eigen::Matrix3Xd course = smooth_course(vessel.centreline_room_mm);
  const Eigen::Index skip = std::clamp<Eigen::Index>(std::lround(from_end_mm), 0, course.cols() - 2);
  RadiographRod catheter;
  catheter.centreline_room_mm = course.leftCols(course.cols() - skip).rowwise().reverse();
  for (const double s_mm : {2.0, 7.0, 10.0, 15.0}) {
    RadiographElectrode electrode;
    electrode.s_mm = s_mm;
    electrode.length_mm = s_mm < 3 ? 4 : 1.3;
    catheter.electrodes.push_back(electrode);
  }
  return catheter;
}

}  // namespace tubed
