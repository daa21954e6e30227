#include "daemon/image/tube_end.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/image/sample_vesselness.hpp"

namespace tubed {

namespace {

constexpr double kSlope = 2.0;  // log-odds of one sample from no ridge to a full one, beside its neighbours
constexpr double kLimit = 1.0;  // no single sample may say more than this
constexpr double kBetterThanEnds = 3.0;  // log-odds of the best place against the path's ends

constexpr std::size_t kNearEnd = 10;  // samples behind the end whose height is that of the tip

/// log-odds that the tube ends before sample k, from those that it ends before the first one.
using Odds = std::array<double, kMaxEndSamples + 1>;

std::size_t compare(const std::array<double, kMaxEndSamples>& seen, std::size_t count, double height,
                    Odds& ends) {
  ends[0] = 0;
  for (std::size_t k = 0; k < count; ++k) {
    ends[k + 1] = ends[k] - std::clamp(kSlope * (seen[k] / height - 0.5), -kLimit, kLimit);
  }
  const auto best = std::max_element(ends.begin(), ends.begin() + static_cast<std::ptrdiff_t>(count + 1));
  return static_cast<std::size_t>(best - ends.begin());
}

/// Many a tip carries an electrode or a marker and is far darker than the rest: its edge is where half of its
/// own height is reached.
double height_behind(const std::array<double, kMaxEndSamples>& seen, std::size_t count, std::size_t end,
                     double usual_height) {
  std::array<double, kNearEnd> near_end{};
  std::size_t taken = 0;
  for (std::size_t k = end; k < count && taken < kNearEnd; ++k) {
    near_end[taken++] = seen[k];
  }
  if (taken == 0) {
    return usual_height;
  }
  const auto middle = near_end.begin() + static_cast<std::ptrdiff_t>(taken / 2);
  std::nth_element(near_end.begin(), middle, near_end.begin() + static_cast<std::ptrdiff_t>(taken));
  return std::max(usual_height, *middle);
}

}  // namespace

std::optional<TubeEnd> find_tube_end(const ImageMeasurement& image, std::span<const Eigen::Vector2d> path_px,
                                     float ridge_height) {
  const auto count = std::min<std::size_t>(path_px.size(), kMaxEndSamples);
  if (count < 3 || !(ridge_height > 0)) {
    return std::nullopt;
  }
  std::array<double, kMaxEndSamples> seen{};
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Vector2d& p_px = path_px[k];
    if (!image.measured.covers_box(p_px, p_px.array() + 1)) {
      return std::nullopt;  // nobody has looked there
    }
    seen[k] = static_cast<double>(sample_vesselness(image, p_px));
  }
  Odds ends{};
  const auto usual_height = static_cast<double>(ridge_height);
  const std::size_t coarse = compare(seen, count, usual_height, ends);
  const std::size_t best = compare(seen, count, height_behind(seen, count, coarse, usual_height), ends);
  if (ends[best] - ends[0] < kBetterThanEnds || ends[best] - ends[count] < kBetterThanEnds) {
    return std::nullopt;
  }
  double sum = 0;
  double first_moment = 0;
  double second_moment = 0;
  for (std::size_t k = 0; k <= count; ++k) {
    const double p = std::exp(ends[k] - ends[best]);
    const double place = static_cast<double>(k) - 0.5;  // between samples k - 1 and k
    sum += p;
    first_moment += p * place;
    second_moment += p * place * place;
  }
  TubeEnd end;
  end.place = first_moment / sum;
  end.variance = std::max(0.0, second_moment / sum - end.place * end.place);
  return end;
}

}  // namespace tubed
