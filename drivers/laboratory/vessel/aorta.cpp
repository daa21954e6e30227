#include "drivers/laboratory/vessel/aorta.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/vessel/vessel_centreline.hpp"

namespace tubed {

namespace {

constexpr double kAccess_mm = 100;     ///< femoral and external iliac artery
constexpr double kIliacBend_mm = 50;   ///< each half of the iliac S
constexpr double kAbdominal_mm = 150;  ///< from the bifurcation to the diaphragm
constexpr double kRoot_mm = 20;        ///< from the sinotubular junction to the valve
constexpr double kBranch_mm = 45;
constexpr double kOutside_mm = 25;  ///< the lumen goes on so far before the introducer
constexpr std::array<double, 3> kArchTurns_rad{0.95, 1.05, 0.95};
constexpr std::array<double, 3> kArchRadii{1.12, 0.92, 1.02};  ///< of the mean

/// The pieces of the route and where they begin. Bend directions count from anterior toward the left.
struct Course {
  explicit Course(const AortaDimensions& size)
      : arch_start(kAccess_mm + 2 * kIliacBend_mm + kAbdominal_mm + size.descending_length) {
    using std::numbers::pi;
    const double half_descending = size.descending_length / 2;
    const double arch = -size.arch_turn_from_anterior_rad;
    pieces = {{kAccess_mm, 0, 0},
              {kIliacBend_mm, size.tortuosity / 130, pi / 2},  // toward the midline
              {kIliacBend_mm, size.tortuosity / 130, -pi / 2},
              {kAbdominal_mm, 1.0 / 600, pi - 0.3},  // along the spine
              {half_descending, size.tortuosity / 420, pi / 2},
              {half_descending, size.tortuosity / 420, -pi / 2 + 0.4}};
    arch_end = arch_start;
    for (std::size_t i = 0; i < kArchTurns_rad.size(); ++i) {
      const double radius = kArchRadii[i] * size.arch_radius;
      pieces.push_back({kArchTurns_rad[i] * radius, 1 / radius, arch + 0.12 * (static_cast<double>(i) - 1)});
      arch_end += kArchTurns_rad[i] * radius;
    }
    pieces.push_back({size.ascending_length, 1.0 / 260, arch - 0.5});
    pieces.push_back({kRoot_mm, 0, 0});
    sinuses = arch_end + size.ascending_length;
    valve = sinuses + kRoot_mm;
  }

  std::vector<VesselPiece> pieces;
  double arch_start;
  double arch_end;
  double sinuses;
  double valve;
};

/// Diameters along the route, linear between the levels of the tables.
double radius_at(double u_mm, const AortaDimensions& size, const Course& course) {
  const double arch = course.arch_end - course.arch_start;
  const std::array<std::pair<double, double>, 15> levels{{
      {-kOutside_mm, size.femoral_diameter},
      {kAccess_mm * 0.8, size.femoral_diameter},
      {kAccess_mm + kIliacBend_mm, size.iliac_diameter},
      {kAccess_mm + 2 * kIliacBend_mm - 5, size.iliac_diameter},
      {kAccess_mm + 2 * kIliacBend_mm + 10, size.infrarenal_diameter},
      {course.arch_start - size.descending_length - 60, size.infrarenal_diameter},
      {course.arch_start - size.descending_length, size.diaphragm_diameter},
      {course.arch_start, size.isthmus_diameter},
      {course.arch_start + 0.3 * arch, size.distal_arch_diameter},
      {course.arch_start + 0.6 * arch, size.proximal_arch_diameter},
      {course.arch_start + 0.95 * arch, size.before_innominate_diameter},
      {course.arch_end + 0.4 * size.ascending_length, size.ascending_diameter},
      {course.sinuses, 0.93 * size.sinus_diameter},  // sinotubular junction
      {course.valve - 0.5 * kRoot_mm, size.sinus_diameter},
      {course.valve, size.annulus_diameter},
  }};
  std::size_t next = 1;
  while (next + 1 < levels.size() && levels[next].first < u_mm) {
    ++next;
  }
  const auto& [u0, d0] = levels[next - 1];
  const auto& [u1, d1] = levels[next];
  const double part = std::clamp((u_mm - u0) / (u1 - u0), 0.0, 1.0);
  return (d0 + part * (d1 - d0)) / 2;
}

/// The closed valve is a shallow cup: no ball may reach further than 3 mm beyond the annulus' plane.
double with_valve(double radius_mm, double to_valve_mm) {
  constexpr double kCup_mm = 3;
  return std::min(radius_mm, std::max(to_valve_mm, 0.0) + kCup_mm);
}

/// One branch of the arch: from its centreline at a share of the arch's length, along `direction`.
std::vector<VesselStation> branch(const VesselCentreline& route, const Course& course, double share,
                                  double diameter_mm, const Eigen::Vector3d& direction) {
  const double u_mm = course.arch_start + share * (course.arch_end - course.arch_start);
  const Eigen::Vector3d start = route.at(u_mm).p_world_mm;
  const Eigen::Vector3d end = start + (15 + kBranch_mm) * direction.normalized();
  return {{start, diameter_mm / 2}, {end, diameter_mm / 2}};
}

VesselCentreline centred_route(const Course& course) {
  const VesselCentreline raw(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY(),
                             course.pieces);
  const Eigen::Vector3d centre =
      (raw.at(course.arch_start).p_world_mm + raw.at(course.arch_end).p_world_mm) / 2;
  return {-centre, Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitY(), course.pieces};
}

}  // namespace

AortaDimensions aorta_of_patient(std::int64_t seed) {
  AortaDimensions size;
  if (seed == 0) {
    return size;
  }
  constexpr std::int64_t kPatientStream = 7001;
  CounterRandom random(seed, kPatientStream, 0);
  const double width = 1 + 0.14 * std::clamp(1.2 * random.signed_unit(), -1.2, 1.2);
  for (double* diameter :
       {&size.annulus_diameter, &size.sinus_diameter, &size.ascending_diameter,
        &size.before_innominate_diameter, &size.proximal_arch_diameter, &size.distal_arch_diameter,
        &size.isthmus_diameter, &size.diaphragm_diameter, &size.infrarenal_diameter, &size.iliac_diameter,
        &size.brachiocephalic_diameter, &size.left_carotid_diameter, &size.left_subclavian_diameter}) {
    *diameter *= width;
  }
  size.arch_radius *= 1 + 0.12 * random.signed_unit();
  size.arch_turn_from_anterior_rad += 0.15 * random.signed_unit();
  size.ascending_length *= 1 + 0.1 * random.signed_unit();
  size.descending_length *= 1 + 0.05 * random.signed_unit();
  size.tortuosity += 0.4 * random.signed_unit();
  return size;
}

Vessel make_aorta(const AortaDimensions& dimensions) {
  const Course course(dimensions);
  const VesselCentreline route = centred_route(course);
  std::vector<VesselStation> stations;
  for (double u_mm = -kOutside_mm; u_mm <= course.valve; u_mm += 1) {
    stations.push_back(
        {route.at(u_mm).p_world_mm, with_valve(radius_at(u_mm, dimensions, course), course.valve - u_mm)});
  }
  std::vector<LumenBall> balls;
  append_tube(stations, balls);
  append_tube(branch(route, course, 0.70, dimensions.brachiocephalic_diameter, {-0.30, -0.05, 1}), balls);
  append_tube(branch(route, course, 0.48, dimensions.left_carotid_diameter, {0.05, 0.0, 1}), balls);
  append_tube(branch(route, course, 0.28, dimensions.left_subclavian_diameter, {0.35, 0.1, 1}), balls);

  const auto first_inside = stations.begin() + static_cast<std::ptrdiff_t>(kOutside_mm);
  return {WallField::of_balls(balls),
          {route.at(0).p_world_mm, route.at(0).tangent_world, -Eigen::Vector3d::UnitY()},
          {first_inside, stations.end()}};
}

}  // namespace tubed
