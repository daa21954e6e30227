// What rods leave of the X-rays behind them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/laboratory/fluoroscope/pixel_rays.hpp"
#include "drivers/laboratory/fluoroscope/radiograph_scene.hpp"
#include "drivers/laboratory/fluoroscope/tube_chord.hpp"

namespace tubed {

/// Adds up the attenuation of tubes along several rays of each pixel that they touch. Used by one thread;
/// allocates in the constructor only.
class RodShadow {
 public:
  /// Keeps a reference to `rays`.
  explicit RodShadow(const PixelRays& rays);

  /// Adds a rod with its lumen and its electrodes.
  void add(const RadiographRod& rod);
  /// Adds a solid tube whose radius and attenuation change from point to point (3 x n, n, n), by one ray a
  /// pixel: for what is wide and soft.
  void add_soft(const Eigen::Matrix3Xd& centreline_room_mm, const Eigen::VectorXd& radius_mm,
                const Eigen::VectorXd& attenuation_per_mm);
  /// Multiplies `transmission` (one value a pixel) by the part of the quanta that goes through what was
  /// added, and forgets it.
  void apply(std::span<float> transmission);

 private:
  static constexpr int kRaysASide = 3;
  static constexpr std::size_t kRays = kRaysASide * kRaysASide;

  enum class Touch : std::uint8_t { kNone, kSoft, kFine };

  /// A tube or shell between two radii.
  struct Shell {
    double radius_mm = 0;
    double hole_radius_mm = 0;
    double attenuation_per_mm = 0;
  };
  /// Which pixels a piece may touch.
  struct Footprint {
    Eigen::Vector2d from_px, axis;  ///< the projected axis: where it begins, its direction
    double length_px = 0;           ///< of the projected axis
    double across_px = 0;           ///< to either side of it
    double beyond_px = 0;           ///< before its begin and behind its end
    int left = 0, right = -1, top = 0, bottom = -1;
  };

  [[nodiscard]] bool footprint(const TubePiece& piece, double radius_mm, Footprint& area) const;
  void add_piece(const TubePiece& piece, const Shell& shell, bool fine);
  void add_electrode(const RadiographRod& rod, const RadiographElectrode& electrode);
  [[nodiscard]] TubePiece piece_of(const Eigen::Matrix3Xd& centreline_room_mm, Eigen::Index from) const;

  const PixelRays& rays_;
  RigidTransform T_camera_room_;
  std::vector<std::array<float, kRays>> attenuation_;  ///< a pixel; all 0 between two apply()
  std::vector<std::uint32_t> touched_;
  std::vector<float> soft_;  ///< of wide tubes, a pixel
  std::vector<Touch> touch_;
};

}  // namespace tubed
