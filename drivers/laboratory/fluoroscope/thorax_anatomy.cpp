#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "idl/geometry/squared.hpp"

namespace tubed::anatomy {

namespace {

struct Knot {
  double z;
  double value;
};

/// Through the knots (from low z to high) with continuous slope (Catmull-Rom), constant beyond.
template <std::size_t n>
double along(const std::array<Knot, n>& knots, double z) {
  if (z <= knots.front().z) {
    return knots.front().value;
  }
  if (z >= knots.back().z) {
    return knots.back().value;
  }
  std::size_t i = 0;
  while (knots[i + 1].z < z) {
    ++i;
  }
  const auto slope = [&](std::size_t at) {
    const std::size_t before = at == 0 ? 0 : at - 1;
    const std::size_t after = std::min(at + 1, n - 1);
    return (knots[after].value - knots[before].value) / (knots[after].z - knots[before].z);
  };
  const double width = knots[i + 1].z - knots[i].z;
  const double t = (z - knots[i].z) / width;
  const double t2 = t * t;
  const double t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * knots[i].value + (t3 - 2 * t2 + t) * width * slope(i) +
         (3 * t2 - 2 * t3) * knots[i + 1].value + (t3 - t2) * width * slope(i + 1);
}

constexpr std::array<Knot, 8> kSpineX{
    {{-420, -27}, {-300, -25}, {-200, -22}, {-120, -17}, {-40, -14}, {40, -13}, {110, -12}, {160, -12}}};
constexpr std::array<Knot, 9> kSpineY{
    {{-420, -14}, {-320, -11}, {-205, 9}, {-130, 31}, {-60, 47}, {0, 53}, {60, 48}, {110, 35}, {160, 22}}};
constexpr std::array<Knot, 11> kCageWidth{{{-400, 118},
                                           {-300, 127},
                                           {-230, 133},
                                           {-170, 138},
                                           {-120, 137},
                                           {-70, 131},
                                           {-20, 119},
                                           {25, 100},
                                           {55, 76},
                                           {78, 50},
                                           {97, 20}}};
constexpr std::array<Knot, 9> kCageDepth{
    {{-400, 84}, {-230, 92}, {-150, 93}, {-90, 90}, {-30, 82}, {20, 70}, {55, 56}, {78, 40}, {97, 16}}};
constexpr std::array<Knot, 8> kSkinWidth{
    {{-420, 150}, {-250, 156}, {-120, 163}, {-20, 167}, {50, 172}, {95, 150}, {125, 95}, {160, 66}}};
constexpr std::array<Knot, 8> kSkinDepth{
    {{-420, 106}, {-250, 112}, {-120, 113}, {-20, 104}, {50, 90}, {95, 74}, {125, 64}, {160, 58}}};

}  // namespace

Eigen::Vector3d spine(double z) { return {along(kSpineX, z), along(kSpineY, z), z}; }

CrossSection rib_cage(double z) {
  const Eigen::Vector3d body = spine(z);
  const double depth = along(kCageDepth, z);
  constexpr double kBehindBodies = 34;
  return {body.x(), body.y() + kBehindBodies - depth, along(kCageWidth, z), depth};
}

CrossSection skin(double z) {
  const Eigen::Vector3d body = spine(z);
  const double depth = along(kSkinDepth, z);
  constexpr double kBehindBodies = 66;
  return {body.x(), body.y() + kBehindBodies - depth, along(kSkinWidth, z), depth};
}

double diaphragm(double x, double y) {
  const Eigen::Vector3d middle = spine(-150);
  const double from_middle = x - middle.x();
  const bool left = from_middle > 0;
  const double apex = left ? -131 : -118;
  const double across = (std::abs(from_middle) - 62) / 76;
  // The crest lies in front; behind, the lung reaches far down.
  const double behind = y - (middle.y() - 62);
  const double fore_aft = behind > 0 ? behind / 84 : behind / 78;
  return apex - 40 * squared(across) * (across > 0 ? 1.25 : 0.45) -
         (behind > 0 ? 78 : 34) * squared(fore_aft);
}

double mediastinum_half_width(double y, double z) {
  const double before_spine = spine(z).y() - y;  // 0 in the vertebral bodies, 120 behind the sternum
  // The lungs reach around the vertebral bodies, and nearly touch each other before the aorta.
  const double at_spine = 17.5 * std::exp(-squared(before_spine / 34));
  const double middle = 19 * std::exp(-squared((before_spine - 42) / 26)) * (1 + 0.25 * std::sin(z / 23));
  const double neck = 24 / (1 + std::exp(-(z - 66) / 10));
  return std::max({at_spine, middle, 4.0 + 2.0 * std::sin(z / 37)}) + neck;
}

}  // namespace tubed::anatomy
