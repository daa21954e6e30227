// What the image half hands to the optimizer for one exposure: y = {intensity, vesselness} of every pixel, or
// why there is none.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/image/frangi_settings.hpp"
#include "daemon/image/image_area.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/interface/timestamps.hpp"
#include "idl/geometry/view_geometry.hpp"

namespace tubed {

enum class ImageState {
  kOff,       ///< fluoroscopy is off at this instant
  kRejected,  ///< pixels came and were refused
  kMeasured,  ///< grey is filled, and vesselness where it was measured
};

enum class ImageRejection { kNone, kWrongSize, kBlack, kSaturated, kFrozen, kNoGeometry, kWrongGeometry };

/// y of the paper for one exposure of one camera. Buffers are reserved once and reused.
struct ImageMeasurement {
  int camera = 0;  ///< index in the room's list
  ImageState state = ImageState::kOff;
  ImageRejection rejection = ImageRejection::kNone;
  Origin origin = Origin::kDevice;
  std::uint32_t frame_number = 0;
  MonotonicTime exposure{};  ///< middle of the exposure
  MonotonicTime grabbed{};
  MonotonicTime frangi_started{};
  MonotonicTime frangi_finished{};
  std::optional<ViewGeometry> geometry;  ///< it was taken with; nothing: as the room has its camera
  bool brought_geometry = false;         ///< that is the image's own, not the configuration's of now
  int width = 0;
  int height = 0;
  std::vector<float> grey;        ///< row by row, as the detector gave it
  float darkest = 0;              ///< least of them
  float brightest = 0;            ///< greatest of them
  std::vector<float> vesselness;  ///< row by row, 0 .. 1 of ridges, Frangi; holds in `measured` only
  ImageArea measured;             ///< elsewhere nobody has looked: neither ridge nor none
  RidgePolarity polarity = RidgePolarity::kDark;        ///< of the ridges in vesselness
  bool finds_polarity = false;                          ///< the next image's follows what is found of this
  std::array<float, kMaxFrangiScales> structureness{};  ///< c of each scale that vesselness was measured with

  /// All of it counts as measured, until a VesselnessMeter takes it.
  void reserve(int reserved_width, int reserved_height) {
    width = reserved_width;
    height = reserved_height;
    const auto pixels = static_cast<std::size_t>(reserved_width) * static_cast<std::size_t>(reserved_height);
    grey.resize(pixels);
    vesselness.resize(pixels);
    measured = ImageArea(reserved_width, reserved_height);
    measured.add_whole();
  }
};

}  // namespace tubed
