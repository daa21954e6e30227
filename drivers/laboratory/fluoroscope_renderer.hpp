// Draws what one view of a fluoroscope sees of the simulated world.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/laboratory/simulated_world.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// 8-bit grey pictures: a still chest-like background (smooth texture, rib-like bands), the catheters as dark
/// bands as wide as their diameter projects (half of the contrast at the edge, blurred by 0.8 px), white
/// Gaussian noise. The noise of an exposure is a window, placed anew for each, of one field drawn at
/// construction: cheap, and a pure function of seed, camera and exposure number. Used by one thread; render()
/// never allocates.
class FluoroscopeRenderer {
 public:
  static constexpr double kCatheterContrast_grey = 20;

  /// `cnr`: contrast of the catheter to the standard deviation of the noise in one pixel.
  FluoroscopeRenderer(const CameraCalibration& camera, const SimulatedWorld& world, std::int64_t seed,
                      double cnr);

  /// From here on as seen from there. The background follows as what lies kBackgroundDepth_mm behind what the
  /// optical axis at rest shows nearest to the world's origin, flat.
  void look_from(const ViewGeometry& view);
  static constexpr double kBackgroundDepth_mm = 100;

  /// Draws exposure number `exposure`, taken at `t_s` of the world, into width x height pixels. `world` is
  /// the one given at construction, or an equal one.
  void render(const SimulatedWorld& world, double t_s, std::int64_t exposure, std::span<std::uint8_t> pixels);

 private:
  struct Outline {
    Eigen::Vector2d p_image_px = Eigen::Vector2d::Zero();
    double radius_px = 0;
    bool seen = false;
  };

  void draw_background(std::int64_t exposure);
  void draw_catheter(const SimulatedWorld& world, int instrument, double t_s);
  void project_centreline(const SimulatedWorld& world, int instrument, double t_s);
  void cover(const Outline& from, const Outline& to);
  [[nodiscard]] float coverage(double distance_px, double radius_px) const;

  Camera camera_;
  Eigen::Vector3d background_world_mm_;      ///< its middle
  Eigen::Vector2i background_off_px_{0, 0};  ///< from where it is at rest
  int width_;
  int height_;
  std::int64_t seed_;
  std::vector<float> background_;  ///< grey levels
  int noise_width_;
  std::vector<float> noise_;            ///< grey levels, wider and higher than the image by kNoiseMargin
  std::vector<float> normal_integral_;  ///< of the detector's blur
  std::vector<float> picture_;
  std::vector<float> coverage_;         ///< of the catheter being drawn, 0 .. 1; all 0 between two
  std::vector<std::uint32_t> covered_;  ///< pixels with coverage above 0; capacity of a whole image
  std::vector<Outline> outline_;
};

}  // namespace tubed
