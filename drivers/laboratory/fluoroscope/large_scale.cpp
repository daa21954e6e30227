#include "drivers/laboratory/fluoroscope/large_scale.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"

namespace tubed {

namespace {

/// A grid of blocks over a picture.
struct Blocks {
  Blocks(int image_width, int image_height, double sigma_px)
      : side(std::max(1, static_cast<int>(sigma_px / 6))),
        width((image_width + side - 1) / side),
        height((image_height + side - 1) / side),
        values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  [[nodiscard]] float at(int column, int row) const {
    const int x = std::clamp(column, 0, width - 1);
    const int y = std::clamp(row, 0, height - 1);
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  [[nodiscard]] float interpolated(int x, int y) const {
    const float column = (static_cast<float>(x) + 0.5F) / static_cast<float>(side) - 0.5F;
    const float row = (static_cast<float>(y) + 0.5F) / static_cast<float>(side) - 0.5F;
    const int left = static_cast<int>(std::floor(column));
    const int top = static_cast<int>(std::floor(row));
    const float part_x = column - static_cast<float>(left);
    const float part_y = row - static_cast<float>(top);
    const float above = at(left, top) + part_x * (at(left + 1, top) - at(left, top));
    const float below = at(left, top + 1) + part_x * (at(left + 1, top + 1) - at(left, top + 1));
    return above + part_y * (below - above);
  }

  int side;
  int width;
  int height;
  std::vector<float> values;
};

}  // namespace

std::vector<float> large_scale(std::span<const float> image, std::span<const float> weight, int width,
                               int height, double sigma_px) {
  Blocks sums(width, height, sigma_px);
  Blocks weights(width, height, sigma_px);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      const auto block = static_cast<std::size_t>(y / sums.side) * static_cast<std::size_t>(sums.width) +
                         static_cast<std::size_t>(x / sums.side);
      sums.values[block] += weight[pixel] * image[pixel];
      weights.values[block] += weight[pixel];
    }
  }
  PointSpread spread(sums.width, sums.height, sigma_px / sums.side);
  spread.apply(sums.values);
  spread.apply(weights.values);
  std::vector<float> smooth(image.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float around = weights.interpolated(x, y);
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      smooth[pixel] = around > 1e-6F ? sums.interpolated(x, y) / around : 0.0F;
    }
  }
  return smooth;
}

}  // namespace tubed
