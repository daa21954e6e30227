#include <cmath>

#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"
#include "drivers/laboratory/fluoroscope/thorax_parts.hpp"

namespace tubed {

namespace {

using namespace anatomy;

/// 0 below -width / 2, 1 above.
float ramp(double distance_mm, double width_mm) {
  return static_cast<float>(std::clamp(0.5 + distance_mm / width_mm, 0.0, 1.0));
}

float mix(float a, float b, float part) { return a + part * (b - a); }

/// Depth, mm, below a border between ellipse and rectangle (`square` 0 .. 1), exact to first order; negative
/// outside.
double depth_inside(const CrossSection& section, double x, double y, double square) {
  const double u = (x - section.x) / section.half_width;
  const double v = (y - section.y) / section.half_depth;
  const double u2 = u * u;
  const double v2 = v * v;
  const double level = (1 - square) * (u2 + v2) + square * (u2 * u2 + v2 * v2);
  return (1 - level) / (2 + 2 * square) * std::min(section.half_width, section.half_depth);
}

/// What one voxel of the body consists of.
class SoftTissue {
 public:
  explicit SoftTissue(const TissueTexture& texture) : texture_(texture) {}

  /// `edge_mm`: how wide a border is mixed.
  void at_height(double z) {
    cage_ = rib_cage(z);
    skin_ = skin(z);
    above_apex_ = z > 96;
  }

  float at(const Eigen::Vector3d& p, double edge_mm) const {
    const double depth = depth_inside(skin_, p.x(), p.y(), 0.4);
    if (depth < -edge_mm) {
      return 0;
    }
    const float coarse = texture_.at(p, 15);
    const float middle = texture_.at(p, 5.5);
    const float fine = texture_.nearest(p, 1.9);
    const float in_cage = above_apex_ ? 0.0F : ramp(depth_inside(cage_, p.x(), p.y(), 0.1), edge_mm);
    float value = wall(p, depth, coarse, middle, fine);
    if (in_cage > 0) {
      value = mix(value, inside(p, edge_mm, coarse, middle, fine), in_cage);
    }
    return value * ramp(depth, edge_mm);
  }

 private:
  /// Skin, fat, muscle with fat between its bundles.
  float wall(const Eigen::Vector3d& p, double depth, float coarse, float middle, float fine) const {
    if (depth < 1.8) {
      return kSoft;
    }
    const double fat_mm = 11 + 5 * coarse;
    const float muscle = ramp(depth - fat_mm, 2);
    // Bundles run up and down: stretched texture.
    const float bundle = texture_.at({p.x(), p.y(), p.z() / 5}, 4);
    const float between = ramp(bundle - 0.35, 0.3);
    return mix(kFat * (1 + 0.03F * middle), mix(kMuscle, kFat, 0.6F * between), muscle) * (1 + 0.03F * fine);
  }

  float inside(const Eigen::Vector3d& p, double edge_mm, float coarse, float middle, float fine) const {
    const float soft = below_diaphragm(p, coarse, middle, fine);
    const double above = p.z() - diaphragm(p.x(), p.y());
    const float chest = ramp(above, edge_mm);
    if (chest <= 0) {
      return soft;
    }
    const double beside = std::abs(p.x() - spine(p.z()).x()) - mediastinum_half_width(p.y(), p.z());
    const float lung = ramp(beside + 2.5 * coarse, 1.5 * edge_mm);
    // Mediastinal fat around lymph nodes; lungs are denser where they lie: behind, and at their base.
    const float fat = mix(kFat, kSoft, ramp(middle + 0.5F * coarse, 0.5));
    const float gravity = static_cast<float>(1 + 0.0035 * (p.y() - cage_.y) + 0.12 * std::exp(-above / 18));
    const float parenchyma = kLung * gravity * (1 + 0.12F * coarse + 0.22F * middle + 0.35F * fine);
    return mix(soft, mix(fat, parenchyma, lung), chest);
  }

  /// Liver on the right, stomach, spleen and gut in fat on the left and below.
  float below_diaphragm(const Eigen::Vector3d& p, float coarse, float middle, float fine) const {
    const double across = p.x() - cage_.x;
    const double liver_edge = 20 - across + 14 * coarse + 0.35 * (p.z() + 235);
    const float liver = ramp(liver_edge, 4) * ramp(p.z() + 262 + 0.35 * across, 6);
    const float gut = mix(kFat, kSoft, ramp(texture_.at(p, 24) + 0.6F * coarse + 0.25, 0.35));
    const float left = mix(gut, kSoft, ramp(p.z() + 215, 30));
    return mix(left * (1 + 0.035F * middle), kLiver, liver) * (1 + 0.025F * fine);
  }

  const TissueTexture& texture_;
  CrossSection cage_;
  CrossSection skin_;
  bool above_apex_ = false;
};

}  // namespace

void paint_soft_tissue(AttenuationVolume& volume, const TissueTexture& texture) {
  const double spacing = volume.spacing_mm().x();
  const Eigen::Vector3d origin = volume.T_room_volume().translation();
  SoftTissue tissue(texture);
  for (int k = 0; k < volume.size().z(); ++k) {
    tissue.at_height(origin.z() + k * spacing);
    for (int j = 0; j < volume.size().y(); ++j) {
      for (int i = 0; i < volume.size().x(); ++i) {
        const float value = tissue.at(origin + spacing * Eigen::Vector3d(i, j, k), spacing);
        if (value > 0) {
          volume.set(i, j, k, value);
        }
      }
    }
  }
}

void paint_gas(VolumePainter& painter, std::int64_t seed) {
  const Eigen::Vector3d middle = spine(-170);
  painter.ellipsoid(middle + Eigen::Vector3d(52, -68, -2), {31, 26, 15}, 0.0F);
  painter.ellipsoid(middle + Eigen::Vector3d(30, -78, -12), {24, 18, 11}, 0.0F);
  const std::uint64_t key = noise_key(seed, 31, 0);
  for (std::uint64_t i = 0; i < 13; ++i) {
    const auto between = [&, at = 8 * i](std::uint64_t n, double low, double high) {
      return low + (high - low) * unit_noise(key + at + n);
    };
    const Eigen::Vector3d centre(middle.x() + between(0, -95, 100), middle.y() + between(1, -125, -60),
                                 between(2, -370, -225));
    const double radius = between(3, 7, 17);
    painter.ellipsoid(centre, {radius * between(4, 0.8, 1.7), radius, radius * between(5, 0.7, 1.1)},
                      0.0015F);
  }
}

}  // namespace tubed
