// One view of a fluoroscope: a digitally reconstructed radiograph of a patient with catheters in it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"
#include "drivers/laboratory/fluoroscope/radiograph_scene.hpp"
#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// What became of an exposure.
enum class RadiographOutcome {
  kExposed,      ///< the pixels are written
  kNoRadiation,  ///< fluoroscopy is off: the pixels are left alone
};

/// Casts the rays of one camera through `volume` once (and once for each cached phase of heart and lungs),
/// then draws exposures: Beer-Lambert, scatter, quanta, detector, logarithm, window. Two views are two
/// objects over the same volume. Used by one thread. The same seed, camera name, settings and sequence of
/// scenes give the same pixels on the same machine; without detector lag an exposure depends on its scene
/// alone.
class Radiograph {
 public:
  /// Takes half a second for a still patient, some seconds with phases. `volume` is needed during
  /// construction only. Throws std::invalid_argument that names the setting for one that cannot be, and for
  /// a camera without pixels.
  Radiograph(const CameraCalibration& camera, const AttenuationVolume& volume,
             const RadiographSettings& settings, std::int64_t seed);
  ~Radiograph();
  Radiograph(Radiograph&&) noexcept;
  Radiograph& operator=(Radiograph&&) noexcept;

  /// Draws one exposure into `pixels`, row by row, 8 bit in one byte, 16 bit in two in host order:
  /// bytes_per_image() of them (anything else is a bug of the caller and aborts). Never allocates.
  RadiographOutcome render(const RadiographScene& scene, std::span<std::uint8_t> pixels);

  [[nodiscard]] std::size_t bytes_per_image() const;
  /// How far the patient's tissue at `p_room_mm` has moved at `time_s`, mm: what a catheter that moves with
  /// the patient has to be moved by.
  [[nodiscard]] Eigen::Vector3d tissue_displacement(const Eigen::Vector3d& p_room_mm, double time_s,
                                                    const ClutterStates& clutter) const;
  /// Quanta that one pixel is expected to detect in `scene`, before detector blur and noise; row by row. For
  /// tests and for what needs the picture without noise.
  std::span<const float> expected_quanta(const RadiographScene& scene);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace tubed
