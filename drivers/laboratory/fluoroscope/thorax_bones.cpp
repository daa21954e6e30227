#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"
#include "drivers/laboratory/fluoroscope/thorax_parts.hpp"

namespace tubed {

namespace {

using namespace anatomy;
using Eigen::Vector3d;

constexpr int kFirstThoracic = 3;  ///< before it: three of the neck
constexpr int kVertebrae = 22;

/// One vertebra: where it is and how large.
struct Vertebra {
  Vector3d centre;
  Eigen::Matrix3d axes;  ///< columns: left, posterior, along the spine
  double half_width, half_depth, half_height;

  [[nodiscard]] Vector3d at(double left, double posterior, double up) const {
    return centre + axes * Vector3d(left, posterior, up);
  }
};

Vertebra vertebra(int number) {
  // From the neck down: 18 mm apart at first, 33 mm in the loins.
  double z = 136;
  double pitch = 0;
  for (int i = 0; i <= number; ++i) {
    pitch = 18 + 0.72 * i;
    z -= i == 0 ? 0 : pitch;
  }
  const double down = static_cast<double>(number) / kVertebrae;
  Vertebra body;
  body.centre = spine(z);
  body.axes.col(2) = (spine(z + 8) - spine(z - 8)).normalized();
  body.axes.col(0) = Vector3d::UnitY().cross(body.axes.col(2)).normalized();
  body.axes.col(1) = body.axes.col(2).cross(body.axes.col(0));
  body.half_width = 12.5 + 9.5 * down;
  body.half_depth = 10.5 + 6.5 * down;
  body.half_height = 0.385 * (18 + 0.72 * (number + 0.5));
  return body;
}

/// The body: a waisted drum of marrow within a thin cortex and firm end plates.
void paint_body(VolumePainter& painter, const Vertebra& body, const TissueTexture& texture) {
  const Vector3d reach = Vector3d::Constant(body.half_width + 6);
  painter.fill(body.centre - reach, body.centre + reach, [&](const Vector3d& p, float) {
    const Vector3d local = body.axes.transpose() * (p - body.centre);
    const double height = local.z() / body.half_height;
    const double waist = 0.86 + 0.14 * std::min(height * height, 1.2);
    const Eigen::Vector2d radii = waist * Eigen::Vector2d(body.half_width, body.half_depth);
    const double beside = distance_to_ellipsoid<Eigen::Vector2d>(local.head<2>(), radii);
    const double ends = std::abs(local.z()) - body.half_height;
    const auto cortex = static_cast<float>(std::clamp(1.0 + (beside + 1.0) / 1.2, 0.0, 1.0));
    const auto plate = static_cast<float>(std::clamp(1.0 + (ends + 1.0) / 1.2, 0.0, 1.0));
    const float marrow = (kMarrow) * (1 + 0.10F * texture.at(p, 2.5) + 0.05F * texture.at(p, 6));
    const float shell = std::max(0.38F * cortex, 0.9F * plate);
    return std::pair(std::max(beside, ends), marrow + shell * (kCortical - marrow));
  });
}

/// Arch, joints and processes behind the body.
void paint_arch(VolumePainter& painter, const Vertebra& body, bool thoracic) {
  constexpr double kCortex = 1.1;
  const double wide = body.half_width;
  const double deep = body.half_depth;
  const double high = body.half_height;
  for (const double side : {-1.0, 1.0}) {
    const Vector3d pedicle = body.at(side * 0.68 * wide, deep + 11, 0.28 * high);
    painter.bone(body.at(side * 0.66 * wide, deep - 3, 0.3 * high), pedicle, 4.2, kCortex);
    painter.bone(pedicle, body.at(0, deep + 22, -0.35 * high), 3.4, kCortex);
    painter.bone(body.at(side * 0.72 * wide, deep + 12, 0.95 * high),
                 body.at(side * 0.7 * wide, deep + 15, -1.1 * high), 4.4, kCortex);
    const double reach = thoracic ? 17 : 22;
    painter.bone(pedicle, body.at(side * (0.68 * wide + reach), deep + (thoracic ? 18 : 10), 0.35 * high),
                 4.2, kCortex);
  }
  const double droop = thoracic ? -1.5 * high : -0.5 * high;
  const Vector3d root = body.at(0, deep + 23, -0.3 * high);
  const Vector3d end = body.at(0, deep + (thoracic ? 38 : 42), droop);
  painter.bone(root, end, 3.3, kCortex);
  painter.bone(body.at(0, deep + 25, -0.3 * high - 5), body.at(0, deep + (thoracic ? 37 : 41), droop - 5), 3,
               kCortex);
}

/// Along one rib, from the spine to its front end.
std::vector<Vector3d> rib_course(int rib, double side) {
  const Vertebra body = vertebra(kFirstThoracic + rib);
  constexpr std::array<double, 12> kFrontAngle{2.55, 2.62, 2.60, 2.56, 2.52, 2.46,
                                               2.38, 2.22, 2.02, 1.82, 1.35, 0.95};
  constexpr std::array<double, 12> kDrop{26, 44, 58, 68, 76, 84, 90, 92, 90, 82, 60, 42};
  const auto number = static_cast<std::size_t>(rib);
  std::vector<Vector3d> course{body.at(side * (body.half_width + 1), 4, 0.7 * body.half_height),
                               body.at(side * (body.half_width + 7), 13, 0.5 * body.half_height)};
  constexpr double kBackAngle = 0.33;
  constexpr int kSteps = 44;
  for (int step = 0; step <= kSteps; ++step) {
    const double part = static_cast<double>(step) / kSteps;
    const double angle = kBackAngle + part * (kFrontAngle[number] - kBackAngle);
    const double z = body.centre.z() - 1 - kDrop[number] * (0.75 * part + 0.25 * part * part);
    const CrossSection cage = rib_cage(z);
    constexpr double kOutward = 3.5;
    course.emplace_back(cage.x + side * (cage.half_width + kOutward) * std::sin(angle),
                        cage.y + (cage.half_depth + kOutward) * std::cos(angle), z);
  }
  return course;
}

/// A flat bar along `course`: `half_height` along the body, `half_thickness` across the chest wall.
void paint_bar(VolumePainter& painter, const std::vector<Vector3d>& course, double half_thickness,
               double half_height, double cortex) {
  for (std::size_t i = 0; i + 1 < course.size(); ++i) {
    const Vector3d along = course[i + 1] - course[i];
    const double length = along.norm();
    const Vector3d tangent = along / length;
    const Vector3d up = (Vector3d::UnitZ() - tangent.z() * tangent).normalized();
    const Vector3d outward = tangent.cross(up);
    const Eigen::Vector2d radii(half_thickness, half_height);
    const double reach = half_height + 2;
    painter.fill(course[i].cwiseMin(course[i + 1]).array() - reach,
                 course[i].cwiseMax(course[i + 1]).array() + reach, [&](const Vector3d& p, float) {
                   const double s = (p - course[i]).dot(tangent);
                   if (s < -0.3 || s > length + 0.3) {
                     return std::pair(10.0, 0.0F);
                   }
                   const Vector3d off = p - course[i] - s * tangent;
                   const double outside =
                       distance_to_ellipsoid<Eigen::Vector2d>({off.dot(outward), off.dot(up)}, radii);
                   const auto inner =
                       static_cast<float>(std::clamp(-(outside + cortex) / 1.2 + 0.5, 0.0, 1.0));
                   return std::pair(outside, kCortical + inner * (kMarrow - 0.003F - kCortical));
                 });
  }
}

/// From a rib's front end to the sternum: cartilage that has begun to calcify.
void paint_cartilage(VolumePainter& painter, int rib, const Vector3d& from, double side) {
  if (rib > 9) {
    return;
  }
  const double z_sternum = std::max(18.0 - 17.0 * rib, -112.0);
  const CrossSection cage = rib_cage(z_sternum);
  const Vector3d to(cage.x + side * 17, cage.y - cage.half_depth - 4, z_sternum);
  const CrossSection between = rib_cage((from.z() + to.z()) / 2);
  const Vector3d bend((from.x() + to.x()) / 2 + side * 4,
                      std::min(from.y(), between.y - between.half_depth * 0.9),
                      std::min(from.z(), to.z()) - (rib > 3 ? 3.0 : 0.0));
  painter.capsule(from, bend, 5, kCartilage);
  painter.capsule(bend, to, 5, kCartilage);
}

/// A flat triangle of bone.
void paint_blade(VolumePainter& painter, const Vector3d& a, const Vector3d& b, const Vector3d& c,
                 double half_thickness) {
  const Vector3d normal = (b - a).cross(c - a).normalized();
  const double area = (b - a).cross(c - a).dot(normal);
  const Vector3d low = a.cwiseMin(b).cwiseMin(c).array() - 3;
  const Vector3d high = a.cwiseMax(b).cwiseMax(c).array() + 3;
  painter.fill(low, high, [&](const Vector3d& p, float) {
    const double u = (b - p).cross(c - p).dot(normal) / area;
    const double v = (c - p).cross(a - p).dot(normal) / area;
    const bool inside = u > 0 && v > 0 && u + v < 1;
    return std::pair(inside ? std::abs((p - a).dot(normal)) - half_thickness : 10.0, 0.8F * kCortical);
  });
}

}  // namespace

void paint_spine(VolumePainter& painter, const TissueTexture& texture) {
  for (int number = 0; number < kVertebrae; ++number) {
    const Vertebra body = vertebra(number);
    const bool thoracic = number >= kFirstThoracic && number < kFirstThoracic + 12;
    paint_arch(painter, body, thoracic);
    paint_body(painter, body, texture);
  }
}

void paint_ribs(VolumePainter& painter) {
  for (int rib = 0; rib < 12; ++rib) {
    for (const double side : {-1.0, 1.0}) {
      const std::vector<Vector3d> course = rib_course(rib, side);
      const double size = rib == 0 || rib > 9 ? 0.85 : 1.0;
      paint_bar(painter, course, 3.3 * size, 6.2 * size, 1.0);
      paint_cartilage(painter, rib, course.back(), side);
    }
  }
}

void paint_sternum_and_girdle(VolumePainter& painter) {
  const auto behind_skin = [](double x, double z) {
    const CrossSection cage = rib_cage(z);
    return Vector3d(cage.x + x, cage.y - cage.half_depth - 5, z);
  };
  const auto plate = [&](double z_top, double z_bottom, double half_width) {
    const Vector3d low = behind_skin(-half_width - 4, z_bottom);
    const Vector3d high = behind_skin(half_width + 4, z_top);
    painter.fill(
        low.cwiseMin(high).array() - 12, low.cwiseMax(high).array() + 12, [&](const Vector3d& p, float) {
          const Vector3d middle = behind_skin(0, p.z());
          const Eigen::Vector2d local(p.x() - middle.x(), p.y() - middle.y());
          const double outside = std::max({distance_to_ellipsoid<Eigen::Vector2d>(local, {half_width, 5.5}),
                                           p.z() - z_top, z_bottom - p.z()});
          const auto inner = static_cast<float>(std::clamp(-(outside + 0.9) / 1.2 + 0.5, 0.0, 1.0));
          return std::pair(outside, 0.9F * kCortical + inner * (kMarrow - 0.002F - 0.9F * kCortical));
        });
  };
  plate(28, -18, 25);
  plate(-21, -112, 18);
  for (const double side : {-1.0, 1.0}) {
    painter.bone(behind_skin(side * 20, 30), behind_skin(side * 72, 44) + Vector3d(0, 2, 0), 5.5, 2);
    painter.bone(behind_skin(side * 72, 44) + Vector3d(0, 2, 0), Vector3d(-12 + side * 134, 18, 84), 4.8,
                 1.1);
    // The arms are raised.
    const Vector3d head(-12 + side * 150, 26, 96);
    painter.bone(head, head + Vector3d(side * 3, 0, 4), 22, 1.2);
    painter.bone(head, head + Vector3d(side * 22, -8, 80), 13, 3);
    const double x = -13 + side * 1.0;
    const Vector3d inner_top(x + side * 72, 84, 52);
    const Vector3d inner_bottom(x + side * 92, 92, -76);
    const Vector3d outer(x + side * 142, 52, 62);
    paint_blade(painter, inner_top, inner_bottom, outer, 1.5);
    painter.bone(inner_bottom, outer, 3.2, 0.9);
    painter.bone(inner_top + Vector3d(side * 8, 6, -8), Vector3d(x + side * 140, 46, 82), 3.2, 0.7);
  }
}

}  // namespace tubed
