// What the image half hands to the optimizer for one exposure: y = {intensity, vesselness} of every pixel, or
// why there is none.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/interface/image_source.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

enum class ImageState {
  kOff,       ///< fluoroscopy is off at this instant
  kRejected,  ///< pixels came and were refused
  kMeasured,  ///< grey and vesselness are filled
};

enum class ImageRejection { kNone, kWrongSize, kBlack, kSaturated, kFrozen };

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
  int width = 0;
  int height = 0;
  std::vector<float> grey;        ///< row by row, as the detector gave it
  std::vector<float> vesselness;  ///< row by row, 0 .. 1 of dark ridges, Frangi

  void reserve(int reserved_width, int reserved_height) {
    width = reserved_width;
    height = reserved_height;
    const auto pixels = static_cast<std::size_t>(reserved_width) * static_cast<std::size_t>(reserved_height);
    grey.resize(pixels);
    vesselness.resize(pixels);
  }
};

}  // namespace tubed
