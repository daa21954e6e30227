// The picture that one view of the simulated fluoroscope takes, for the live source and sequence folders
// alike.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"
#include "drivers/laboratory/fluoroscope/radiograph.hpp"
#include "drivers/laboratory/fluoroscope_renderer.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// The body that the preset's catheter is in: a chest with the preset's aorta, a second or two, or a mock-up
/// of it. Precondition: the world has a preset.
AttenuationVolume body_of(const SimulatedWorld& world);

/// Middles of the ring electrodes that every preset's catheter has, from the tip; each is so long.
std::vector<double> ring_electrodes_mm();
inline constexpr double kRingElectrode_mm = 1.3;

/// May the table be panned on request? Then the chest of a preset is kept, to be cast anew.
enum class PanOnRequest { kNo, kYes };

/// Pictures of 8 bits, or as a panel has: of a preset, radiographs of a chest; of "arch", drawn bands on a
/// still background. Used by one thread. render() never allocates, but that a preset's view which stands
/// elsewhere than for the picture before has the rays of the chest cast anew: a second or so, some seconds
/// where heart and lungs move.
class SimulatedView {
 public:
  /// `cnr` is used for "arch" only, `body` for presets: nullptr makes one. It is kept where the view moves.
  SimulatedView(const CameraCalibration& camera, const SimulatedWorld& world, std::int64_t seed, double cnr,
                std::shared_ptr<const AttenuationVolume> body = nullptr,
                PanOnRequest pan = PanOnRequest::kNo);

  /// From the next picture on the table stands so far aside, along the camera's x at rest, beside whatever
  /// the world has the view do; no image says so. Precondition: PanOnRequest::kYes. Never allocates.
  void pan_table(double pan_mm) { pan_mm_ = pan_mm; }

  /// Draws exposure number `exposure`, taken at `t_s` of the world, into width x height pixels. `world` is
  /// the one given at construction, or an equal one.
  /// A picture has bytes_per_image() bytes.
  void render(const SimulatedWorld& world, double t_s, std::int64_t exposure, std::span<std::uint8_t> pixels);

  /// Words of 16 bits where the preset has a panel.
  [[nodiscard]] PixelDepth depth() const {
    return full_grey_ > 255 ? PixelDepth::kGrey16 : PixelDepth::kGrey8;
  }
  [[nodiscard]] std::size_t bytes_per_image() const;

 private:
  void look_from(const ViewGeometry& view);
  template <typename Pixel>
  void spoil(const RoomMistakes& mistakes, std::span<Pixel> pixels) const;
  void place_catheters(const SimulatedWorld& world, double t_s);

  std::unique_ptr<FluoroscopeRenderer> drawn_;  ///< for "arch"
  std::unique_ptr<Radiograph> radiograph_;      ///< for presets
  RadiographScene scene_;
  CameraCalibration at_rest_;
  ViewGeometry view_;  ///< from where the next picture is drawn, unless it moves
  std::int64_t seed_;
  double pan_mm_ = 0;
  int full_grey_ = 255;                            ///< of a saturated pixel
  std::shared_ptr<const AttenuationVolume> body_;  ///< where the view moves
  std::unique_ptr<const RadiographSettings> settings_;
};

}  // namespace tubed
