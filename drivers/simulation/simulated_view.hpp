// The picture that one view of the simulated fluoroscope takes, for the live source and sequence folders
// alike.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "daemon/geometry/camera.hpp"
#include "drivers/simulation/fluoroscope/attenuation_volume.hpp"
#include "drivers/simulation/fluoroscope/radiograph.hpp"
#include "drivers/simulation/fluoroscope_renderer.hpp"
#include "drivers/simulation/simulated_world.hpp"

namespace tubed {

/// The body that the preset's catheter is in: a chest with the preset's aorta. Takes a second or two.
/// Precondition: the world has a preset.
AttenuationVolume body_of(const SimulatedWorld& world);

/// 8-bit pictures: of a preset, radiographs of a chest; of "arch", drawn bands on a still background. Used by
/// one thread; render() never allocates while nothing but the catheter and its patient move.
class SimulatedView {
 public:
  /// `cnr` is used for "arch" only, `body` (needed during construction only) for presets: nullptr makes one.
  SimulatedView(const CameraCalibration& camera, const SimulatedWorld& world, std::int64_t seed, double cnr,
                const AttenuationVolume* body = nullptr);

  /// Draws exposure number `exposure`, taken at `t_s` of the world, into width x height pixels. `world` is
  /// the one given at construction, or an equal one.
  void render(const SimulatedWorld& world, double t_s, std::int64_t exposure, std::span<std::uint8_t> pixels);

 private:
  void place_catheters(const SimulatedWorld& world, double t_s);

  std::unique_ptr<FluoroscopeRenderer> drawn_;  ///< for "arch"
  std::unique_ptr<Radiograph> radiograph_;      ///< for presets
  RadiographScene scene_;
};

}  // namespace tubed
