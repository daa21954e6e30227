#include <cmath>
#include <numbers>

#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"
#include "drivers/laboratory/fluoroscope/thorax_parts.hpp"

namespace tubed {

namespace {

using namespace anatomy;
using Eigen::Vector3d;

struct Chamber {
  Vector3d centre;
  Vector3d radii;
  Eigen::Matrix3d axes;
};

/// Axes whose first column points along `direction`.
Eigen::Matrix3d axes_along(const Vector3d& direction) {
  Eigen::Matrix3d axes;
  axes.col(0) = direction.normalized();
  axes.col(1) = axes.col(0).unitOrthogonal();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

/// A vessel of a tree that keeps to the lung.
struct Branch {
  Vector3d from;
  Vector3d direction;
  double radius;
  double length;
  int generation;
  std::uint64_t key;
};

bool in_lung(const Vector3d& p) {
  const CrossSection cage = rib_cage(p.z());
  const Eigen::Vector2d across((p.x() - cage.x) / (cage.half_width - 5),
                               (p.y() - cage.y) / (cage.half_depth - 5));
  return p.z() < 90 && across.squaredNorm() < 1 && p.z() > diaphragm(p.x(), p.y()) + 4 &&
         std::abs(p.x() - spine(p.z()).x()) > mediastinum_half_width(p.y(), p.z()) - 6;
}

void grow(VolumePainter& painter, const Branch& branch) {
  constexpr int kGenerations = 8;
  const Vector3d to = branch.from + branch.length * branch.direction;
  if (branch.generation > 0 && !in_lung(to)) {
    return;
  }
  const double reach = branch.radius + 2;
  painter.fill(branch.from.cwiseMin(to).array() - reach, branch.from.cwiseMax(to).array() + reach,
               [&](const Vector3d& p, float was) {
                 const double distance = distance_to_segment(p, branch.from, to) - branch.radius;
                 return std::pair(was > 0.5F * kSoft ? 10.0 : distance, kBlood);
               });
  if (branch.generation == kGenerations) {
    return;
  }
  const double twist = 2 * std::numbers::pi * unit_noise(branch.key);
  const Vector3d side = branch.direction.unitOrthogonal();
  const Vector3d fork = std::cos(twist) * side + std::sin(twist) * branch.direction.cross(side);
  for (std::uint64_t child = 0; child < 2; ++child) {
    const std::uint64_t key = noise_key(static_cast<std::int64_t>(branch.key), 5, child);
    const double angle = (child == 0 ? 0.34 : -0.52) * (0.6 + 0.8 * unit_noise(key + 1));
    const double shrink = (child == 0 ? 0.83 : 0.70) * (0.92 + 0.16 * unit_noise(key + 2));
    grow(painter, {to, (branch.direction + std::tan(angle) * fork).normalized(), branch.radius * shrink,
                   branch.length * (0.78 + 0.22 * unit_noise(key + 3)), branch.generation + 1, key});
  }
}

}  // namespace

void paint_heart(VolumePainter& painter, const TissueTexture& texture) {
  const std::array<Chamber, 5> chambers{{
      {{22, -64, -106}, {60, 37, 36}, axes_along({0.66, -0.42, -0.62})},  // left ventricle
      {{2, -84, -112}, {46, 26, 33}, axes_along({0.85, -0.15, -0.5})},    // right ventricle
      {{-34, -54, -98}, {29, 30, 40}, axes_along({0.97, -0.1, 0.2})},     // right atrium
      {{-4, -26, -80}, {35, 21, 24}, Eigen::Matrix3d::Identity()},        // left atrium
      {{22, -48, -58}, {19, 17, 24}, axes_along({0.3, 0.5, 0.8})},        // outflow tract, left auricle
  }};
  painter.fill({-95, -125, -170}, {100, 20, -40}, [&](const Vector3d& p, float) {
    double outside = 1e3;
    for (const Chamber& chamber : chambers) {
      const Vector3d local = chamber.axes.transpose() * (p - chamber.centre);
      const double distance = distance_to_ellipsoid<Vector3d>(local, chamber.radii);
      // A smooth union: grooves between the chambers are filled with fat.
      const double h = std::clamp(0.5 + (outside - distance) / 32, 0.0, 1.0);
      outside = outside + h * (distance - outside) - 16 * h * (1 - h);
    }
    const double fat = outside + 3.5 + 5 * texture.at(p, 11);
    const float muscle = static_cast<float>(std::clamp(0.5 - fat / 3, 0.0, 1.0));
    const float value = kFat + muscle * (kBlood - kFat);
    // Its border is not as smooth as an ellipsoid's.
    return std::pair(outside + 3.0 * texture.at(p, 27), value * (1 + 0.02F * texture.at(p, 4)));
  });
}

void paint_great_vessels(VolumePainter& painter, const VesselCourse& aorta) {
  const auto artery = [&](std::initializer_list<Vector3d> course, double radius) {
    for (const Vector3d* p = course.begin(); p + 1 != course.end(); ++p, radius *= 0.82) {
      painter.capsule(*p, p[1], radius, kBlood);
    }
  };
  artery({{12, -66, -66}, {17, -50, -40}, {21, -34, -24}}, 13.5);  // pulmonary trunk
  artery({{18, -34, -26}, {-26, -20, -32}, {-46, -10, -42}, {-58, 4, -64}, {-66, 14, -92}}, 10.5);
  artery({{-40, -14, -36}, {-56, -14, -22}, {-66, -10, 0}}, 6.5);
  artery({{21, -34, -24}, {34, -12, -16}, {46, 8, -30}, {54, 22, -56}, {60, 28, -84}}, 11);
  artery({{38, -6, -18}, {54, -6, -4}, {62, -4, 16}}, 6);
  artery({{-12, -24, -84}, {-40, -8, -86}, {-60, 0, -104}}, 6.5);  // lung veins
  artery({{8, -24, -84}, {36, 0, -86}, {58, 12, -108}}, 6.5);
  painter.capsule({-40, -22, 55}, {-43, -42, -75}, 9, kBlood);      // superior vena cava
  painter.capsule({-43, -44, -110}, {-40, -30, -210}, 11, kBlood);  // inferior vena cava
  painter.capsule({-40, -26, 52}, {36, -26, 72}, 6.5, kBlood);      // left brachiocephalic vein
  for (Eigen::Index i = 0; i + 1 < aorta.radius_mm.size(); ++i) {
    const double radius = (aorta.radius_mm[i] + aorta.radius_mm[i + 1]) / 2 + 1.5;
    painter.capsule(aorta.centreline_room_mm.col(i), aorta.centreline_room_mm.col(i + 1), radius, kBlood);
  }
  painter.capsule({-14, -6, 28}, {-34, -8, 88}, 7, kBlood);  // brachiocephalic artery
  painter.capsule({2, 6, 32}, {8, 4, 95}, 5, kBlood);        // left common carotid artery
  painter.capsule({14, 15, 26}, {30, 22, 82}, 6, kBlood);    // left subclavian artery
}

void paint_airways(VolumePainter& painter) {
  const auto tube = [&](const Vector3d& a, const Vector3d& b, double radius) {
    painter.capsule(a, b, radius + 1.6, kCartilage);
    return std::tuple(a, b, radius);
  };
  const Vector3d top = spine(135) + Vector3d(0, -26, 0);
  const Vector3d carina(-13, 19, -22);
  const std::array tubes{tube(top, carina + Vector3d(0, 4, 40), 7.5),
                         tube(carina + Vector3d(0, 4, 40), carina, 7.5),
                         tube(carina, {-44, 14, -46}, 6),
                         tube(carina, {40, 14, -52}, 5.5),
                         tube({-44, 14, -46}, {-56, 16, -84}, 4.2),
                         tube({-38, 14, -41}, {-66, 6, -24}, 3.6),
                         tube({40, 14, -52}, {54, 18, -86}, 4),
                         tube({36, 14, -49}, {64, 2, -34}, 3.4)};
  for (const auto& [a, b, radius] : tubes) {
    painter.capsule(a, b, radius, 0.0F);
  }
}

void paint_lung_vessels(VolumePainter& painter, std::int64_t seed) {
  const std::array<Vector3d, 9> fan{Vector3d{1, 0.1, 0.9}, {1, -0.6, 0.5},   {1, 0.6, 0.35},
                                    {1, -0.75, -0.25},     {1, 0.35, -0.5},  {0.75, -0.3, -0.9},
                                    {0.6, 0.45, -1},       {0.25, 0.25, -1}, {0.45, -0.1, 1}};
  for (const double side : {-1.0, 1.0}) {
    const Vector3d hilum = side < 0 ? Vector3d(-50, 4, -42) : Vector3d(44, 6, -36);
    std::uint64_t index = 0;
    for (const Vector3d& direction : fan) {
      const std::uint64_t key = noise_key(seed, side < 0 ? 41 : 42, index++);
      const Vector3d jitter(unit_noise(key + 1) - 0.5, unit_noise(key + 2) - 0.5, unit_noise(key + 3) - 0.5);
      const Vector3d toward =
          (Vector3d(side * direction.x(), direction.y(), direction.z()) + 0.4 * jitter).normalized();
      grow(painter, {hilum + 6 * jitter, toward, 4.6, 22 + 8 * unit_noise(key + 4), 0, key});
    }
  }
}

}  // namespace tubed
