#include "daemon/image/ridge_noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tubed {

namespace {

constexpr int kTubesSideBySide = 2;
constexpr std::ptrdiff_t kMinHalfRidge_px = 3;  // from its top to either side
constexpr std::size_t kNeighbours = 4;          // lines to either side that share their noise

}  // namespace

void RidgeNoise::measure(std::span<const CorrespondenceLine> lines, std::span<const Row> vesselness,
                         int states) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!lines[i].in_view) continue;
    Row left = vesselness[i];
    const auto row = std::span(left).first(static_cast<std::size_t>(states));
    const auto half_px = std::max<std::ptrdiff_t>(kMinHalfRidge_px, std::lround(lines[i].half_width_px) + 1);
    for (int tube = 0; tube < kTubesSideBySide; ++tube) {
      const auto ridge = std::ranges::max_element(row) - row.begin();
      const auto first = std::max<std::ptrdiff_t>(ridge - half_px, 0);
      const auto end = std::min<std::ptrdiff_t>(ridge + half_px + 1, states);
      std::fill(row.begin() + first, row.begin() + end, 0.0F);
    }
    third_ridge_[i] = *std::ranges::max_element(row);
  }
}

float RidgeNoise::at(std::span<const CorrespondenceLine> lines, std::size_t line) const {
  float sum = 0;
  int sharing = 0;
  const std::size_t end = std::min(lines.size(), line + kNeighbours + 1);
  for (std::size_t i = line - std::min(line, kNeighbours); i < end; ++i) {
    if (!lines[i].in_view) continue;
    sum += third_ridge_[i];
    ++sharing;
  }
  return sum / static_cast<float>(std::max(sharing, 1));
}

}  // namespace tubed
