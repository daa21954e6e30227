#include "daemon/image/line_profiles.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <tuple>

#include "daemon/image/line_samples.hpp"
#include "daemon/image/nth_smallest.hpp"

namespace tubed {

namespace {

constexpr double kCentre = 0.6;         // of the half width: where the tube is darkest
constexpr double kBeyondSide_px = 1;    // from the tube's side to the first of two pixels of background
constexpr float kNearerSide = 0.6F;     // what the side nearer in grey counts of both
constexpr float kContrastSlope = 6.0F;  // log-odds gained from no contrast to the usual one, without noise
constexpr float kNoiseShare = 10.0F;    // of (noise / usual contrast)^2 by which that is less
constexpr int kNoiseNeighbours = 4;     // lines to either side that share their noise
constexpr float kOfNeighbours = -1;     // every second line has no noise of its own
constexpr float kMedianStep = 0.954F;   // median of |a - b| of two pixels with noise of 1

}  // namespace

// Not of a tube whose sides lie further off than is looked.
bool LineProfiles::is_of_use(const CorrespondenceLine& line) {
  return line.in_view && line.half_width_px > 0 && line.half_width_px < kPadding - kBeyondSide_px - 1;
}

void LineProfiles::measure(const ImageMeasurement& image, std::span<const CorrespondenceLine> lines,
                           int reach_px) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const CorrespondenceLine& line = lines[i];
    if (!is_of_use(line)) continue;
    look_across(image, line, reach_px);
    const auto centre_px = static_cast<int>(std::lround(kCentre * line.half_width_px));
    const auto side_px = static_cast<int>(std::lround(line.half_width_px + kBeyondSide_px));
    for (int state = 0; state <= 2 * reach_px; ++state) {
      contrast_[i][static_cast<std::size_t>(state)] = contrast_at(state + kPadding, centre_px, side_px);
    }
    peaks_[seen++] = *std::max_element(contrast_[i].begin(), contrast_[i].begin() + 2 * reach_px + 1);
    const bool has_neighbour = i % 2 == 1 && is_of_use(lines[i - 1]);
    noise_[i] = has_neighbour ? kOfNeighbours : noise_of(2 * (reach_px + kPadding) + 1);
  }
  const auto middle = peaks_.begin() + static_cast<std::ptrdiff_t>(seen / 2);
  std::nth_element(peaks_.begin(), middle, peaks_.begin() + static_cast<std::ptrdiff_t>(seen));
  weigh(lines, seen > 0 ? *middle : 0);
}

// Dark is up.
void LineProfiles::look_across(const ImageMeasurement& image, const CorrespondenceLine& line, int reach_px) {
  const int furthest_px = reach_px + kPadding;
  const auto greys = std::span(greys_).first(static_cast<std::size_t>(2 * furthest_px + 1));
  sample_line(image, image.grey, {line.base_px - furthest_px * line.normal, line.normal}, BeyondEdge::kEdge,
              greys);
  if (image.polarity == RidgePolarity::kDark) {
    for (float& grey : greys) grey = -grey;
  }
}

// Against both sides, the nearer one in grey more: an edge has one side only, but the lesser of two noisy
// ones is drawn to and fro by what lies behind the tube.
float LineProfiles::contrast_at(int place, int centre_px, int side_px) const {
  const auto grey = [&](int k) { return greys_[static_cast<std::size_t>(place + k)]; };
  float sum = 0;
  for (int k = -centre_px; k <= centre_px; ++k) {
    sum += grey(k);
  }
  const float left = (grey(-side_px) + grey(-side_px - 1)) / 2;
  const float right = (grey(side_px) + grey(side_px + 1)) / 2;
  const float sides = kNearerSide * std::max(left, right) + (1 - kNearerSide) * std::min(left, right);
  return sum / static_cast<float>(2 * centre_px + 1) - sides;
}

float LineProfiles::noise_of(int count) {
  const auto steps = static_cast<std::size_t>(count - 1);
  for (std::size_t k = 0; k < steps; ++k) {
    steps_[k] = std::abs(greys_[k + 1] - greys_[k]);
  }
  return nth_smallest<std::tuple_size_v<Greys>>(std::span(steps_).first(steps), steps / 2) / kMedianStep;
}

void LineProfiles::weigh(std::span<const CorrespondenceLine> lines, float usual) {
  const auto count = static_cast<int>(lines.size());
  for (int i = 0; i < count; ++i) {
    const auto line = static_cast<std::size_t>(i);
    slope_[line] = 0;
    if (!is_of_use(lines[line]) || !(usual > 0)) continue;
    float sum = 0;
    int sharing = 0;
    for (int j = std::max(0, i - kNoiseNeighbours); j <= std::min(count - 1, i + kNoiseNeighbours); ++j) {
      const float noise = noise_[static_cast<std::size_t>(j)];
      if (!is_of_use(lines[static_cast<std::size_t>(j)]) || noise == kOfNeighbours) continue;
      sum += noise;
      ++sharing;
    }
    const float noise = sum / static_cast<float>(sharing) / usual;
    slope_[line] = kContrastSlope / (1 + kNoiseShare * noise * noise);
    for (float& contrast : contrast_[line]) contrast /= usual;
  }
}

}  // namespace tubed
