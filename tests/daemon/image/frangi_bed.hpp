// An image with tubes, maps for it and tiles of it.
#pragma once

#include "daemon/image/frangi.hpp"
#include "tests/daemon/image/exact_frangi.hpp"

namespace tubed {

inline constexpr int kBedWidth = 101;
inline constexpr int kBedHeight = 90;
inline constexpr std::size_t kPixels = kBedWidth * kBedHeight;

struct OwnedMaps {
  std::vector<float> vesselness = std::vector<float>(kPixels, -1.0F);
  std::vector<float> scale_px = std::vector<float>(kPixels, -1.0F);
  std::vector<float> cosine = std::vector<float>(kPixels, -1.0F);
  std::vector<float> sine = std::vector<float>(kPixels, -1.0F);

  RidgeMaps all() { return {vesselness, scale_px, cosine, sine}; }
};

template <typename Pixel>
std::vector<Pixel> tubes() {
  const ExactImage image = tubes_with_noise(kBedWidth, kBedHeight, 0, 255, 0.02);
  return {image.pixels.begin(), image.pixels.end()};
}

inline FrangiSettings fixed_settings() {
  FrangiSettings settings;
  settings.structureness = 15;
  return settings;
}

/// Beyond the image, narrower than a register, empty, outside: as a caller may ask for them.
inline const std::vector<PixelRectangle> kTiles{{0, 0, 33, 20},   {30, 10, 70, 45}, {-5, 80, 20, 200},
                                                {96, 50, 99, 60}, {50, 50, 50, 60}, {200, 10, 220, 20},
                                                {60, 85, 101, 90}};

}  // namespace tubed
