#include "daemon/image/tube_end.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "daemon/image/sample_vesselness.hpp"

namespace tubed {

namespace {

constexpr double kSlope = 2.0;  // log-odds of one sample from no ridge to a full one, beside its neighbours
constexpr double kLimit = 1.0;  // no single sample may say more than this
constexpr double kBetterThanEnds = 3.0;  // log-odds of the best place against the path's ends

constexpr std::size_t kNearEnd = 10;  // samples behind the end whose height is that of the tip

constexpr double kShortest_px_per_mm = 0.2;  // below, a piece of tube lies along the rays
constexpr std::size_t kDirection = 3;        // pieces over which the tip's direction is taken

// The step in grey.
constexpr int kStepOutside = 9;       // samples from the coarse end outward that it is fitted to
constexpr int kStepInside = 6;        // and inward: an electrode at the tip may be no longer
constexpr double kStepPlace = 0.25;   // samples from one place that is tried to the next
constexpr double kBlur = 1.1;         // standard deviation of a radiograph's edge, px: screen, pixel, tip
constexpr double kNeighbours = 3;     // samples that see the same noise
constexpr double kMinGain = 16;       // chi-square by which a step has to be better than none
constexpr double kMinNoise = 0.02;    // of the step's height: no radiograph is better
constexpr double kBeyondSide_px = 2;  // from the tube's side to the background

// Of an end far out.
constexpr std::size_t kAfterStep = 2;      // samples until the whole of the tube is reached
constexpr std::size_t kMinBehindEnd = 20;  // samples by which the tube has to be seen there
constexpr std::size_t kTogether = 4;       // samples that are taken together
constexpr double kMinOfTube = 0.5;         // of the tube's contrast further back
constexpr double kMinOneSide = 0.25;       // the same against one of its sides

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

/// A level on the one side and another on the other, least squares.
struct StepFit {
  double squares = 0;  ///< that are left
  double step = 0;     ///< of the level, inward
};

using StepWindow = std::array<double, kStepOutside + kStepInside + 1>;

// Three samples on either side tell the levels.
constexpr double kMargin = 2.5;
constexpr auto kPlaces =
    static_cast<std::size_t>((kStepOutside + kStepInside - 2 * kMargin) / kStepPlace) + 1;

/// c_k = b + h Phi((k - place) / kBlur).
StepFit fit_step(const StepWindow& seen, double place) {
  const auto count = static_cast<double>(seen.size());
  double c = 0, x = 0, cc = 0, xx = 0, xc = 0;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const double covered = 0.5 * std::erfc((place - static_cast<double>(k)) / (kBlur * std::numbers::sqrt2));
    c += seen[k];
    x += covered;
    cc += seen[k] * seen[k];
    xx += covered * covered;
    xc += covered * seen[k];
  }
  const double spread = xx - x * x / count;
  const double together = xc - x * c / count;
  return {cc - c * c / count - together * together / spread, together / spread};
}

/// Is all that contrast_at() reads in the image?
bool has_sides_at(const ImageMeasurement& image, const Eigen::Vector2d& p_px, double half_width_px) {
  const double reach_px = half_width_px + kBeyondSide_px + 1;
  return (p_px.array() > reach_px).all() && p_px.x() + reach_px < image.width - 1 &&
         p_px.y() + reach_px < image.height - 1;
}

/// How much darker than each of its sides the tube is there.
struct Contrast {
  double left = 0;
  double right = 0;
  [[nodiscard]] double mean() const { return (left + right) / 2; }
};

Contrast contrast_at(const ImageMeasurement& image, const Eigen::Vector2d& p_px, const Eigen::Vector2d& along,
                     double half_width_px) {
  const Eigen::Vector2d across(-along.y(), along.x());
  const auto grey = [&](double offset_px) {
    return static_cast<double>(sample_map(image, image.grey, p_px + offset_px * across));
  };
  const double centre = (grey(-half_width_px / 2) + grey(0) + grey(half_width_px / 2)) / 3;
  const double sign = image.polarity == RidgePolarity::kDark ? 1 : -1;
  Contrast contrast{-centre, -centre};
  for (const double beyond_px : {kBeyondSide_px, kBeyondSide_px + 1}) {
    contrast.left += grey(-half_width_px - beyond_px) / 2;
    contrast.right += grey(half_width_px + beyond_px) / 2;
  }
  return {sign * contrast.left, sign * contrast.right};
}

/// Mean and variance of a place whose log-likelihood is -squares / (2 variance) at first + i * kStepPlace.
template <std::size_t kCount>
TubeEnd posterior_of(const std::array<double, kCount>& squares, double least, double variance, double first) {
  double sum = 0, first_moment = 0, second_moment = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double p = std::exp((least - squares[i]) / (2 * variance));
    const double place = first + static_cast<double>(i) * kStepPlace;
    sum += p;
    first_moment += p * place;
    second_moment += p * place * place;
  }
  const double mean = first_moment / sum;
  return {mean, std::max(0.0, second_moment / sum - mean * mean)};
}

/// Of the samples from `first` on; nothing where not all of it is in the image, or on the path.
std::optional<StepWindow> contrast_along(const ImageMeasurement& image,
                                         std::span<const Eigen::Vector2d> path_px, std::ptrdiff_t first,
                                         double half_width_px) {
  StepWindow seen{};
  const auto count = static_cast<std::ptrdiff_t>(seen.size());
  if (first < 1 || first + count >= static_cast<std::ptrdiff_t>(path_px.size())) return std::nullopt;
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(first + k);
    const Eigen::Vector2d along = (path_px[i + 1] - path_px[i - 1]).normalized();
    if (!has_sides_at(image, path_px[i], half_width_px)) return std::nullopt;
    seen[static_cast<std::size_t>(k)] = contrast_at(image, path_px[i], along, half_width_px).mean();
  }
  return seen;
}

double median(std::span<const Contrast> contrasts) {
  std::array<double, kMaxEndSamples> values{};
  std::ranges::transform(contrasts, values.begin(), &Contrast::mean);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(contrasts.size() / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(contrasts.size()));
  return *middle;
}

/// Is it the tube that ends there? As dark as further back all the way inward, against both sides: what lies
/// beyond a tip, such as a thinner wire, a calcification, the edge of a bone or a marker of something else,
/// is fainter, or against one side only, or has a gap behind it.
bool is_of_tube(const ImageMeasurement& image, std::span<const Eigen::Vector2d> path_px, double end,
                double half_width_px) {
  std::array<Contrast, kMaxEndSamples> contrasts{};
  std::size_t count = 0;
  for (auto k = static_cast<std::size_t>(std::ceil(end)) + kAfterStep; k + 1 < path_px.size(); ++k) {
    if (!has_sides_at(image, path_px[k], half_width_px)) break;
    const Eigen::Vector2d along = (path_px[k + 1] - path_px[k - 1]).normalized();
    contrasts[count++] = contrast_at(image, path_px[k], along, half_width_px);
  }
  if (count < kMinBehindEnd) return false;
  const std::size_t half = count / 2;
  const double of_tube = median(std::span(contrasts).subspan(half, count - half));
  for (std::size_t k = 0; k + kTogether <= half; ++k) {
    Contrast sum;
    for (const Contrast& contrast : std::span(contrasts).subspan(k, kTogether)) {
      sum.left += contrast.left / kTogether;
      sum.right += contrast.right / kTogether;
    }
    if (sum.mean() < kMinOfTube * of_tube || std::min(sum.left, sum.right) < kMinOneSide * of_tube) {
      return false;
    }
  }
  return true;
}

/// The step that explains a window best.
struct StepSearch {
  explicit StepSearch(const StepWindow& seen) {
    const double mean = std::accumulate(seen.begin(), seen.end(), 0.0) / static_cast<double>(seen.size());
    for (const double value : seen) without_step += (value - mean) * (value - mean);
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const StepFit fit = fit_step(seen, kMargin + static_cast<double>(i) * kStepPlace);
      squares[i] = fit.step > 0 ? fit.squares : without_step;
      if (i == 0 || squares[i] < squares[best]) {
        best = i;
        height = fit.step;
      }
    }
  }

  /// In samples from the window's first; nothing where none stands out of the noise.
  [[nodiscard]] std::optional<TubeEnd> found() const {
    constexpr auto kFreedom = static_cast<double>(std::tuple_size_v<StepWindow>) - 3;
    const double variance =
        std::max(kNeighbours * squares[best] / kFreedom, kMinNoise * kMinNoise * height * height);
    if (!(without_step - squares[best] > kMinGain * variance)) return std::nullopt;
    return posterior_of(squares, squares[best], variance, kMargin);
  }

  std::array<double, kPlaces> squares{};  ///< that are left with the step at each place
  double without_step = 0;
  double height = 0;  ///< of the best one
  std::size_t best = 0;
};

}  // namespace

std::optional<EndPath> EndPath::over(std::span<const Eigen::Vector2d> found_px, double spacing_mm,
                                     int outside_px) {
  const Eigen::Vector2d tip = found_px[0] - found_px[kDirection];
  const double spacing_px = tip.norm() / kDirection;
  if (!(spacing_px > kShortest_px_per_mm * spacing_mm)) return std::nullopt;
  EndPath path;
  path.outward_ = tip.normalized();
  for (int k = outside_px; k > 0; --k) path.points_px_[path.count_++] = found_px[0] + k * path.outward_;
  for (double along_px = 0; path.count_ < path.points_px_.size(); along_px += 1) {
    const double piece = along_px / spacing_px;
    const auto before = static_cast<std::size_t>(piece);
    if (before + 1 >= found_px.size()) break;
    path.points_px_[path.count_++] =
        found_px[before] + (piece - static_cast<double>(before)) * (found_px[before + 1] - found_px[before]);
  }
  return path;
}

Eigen::Vector2d EndPath::at(double place) const {
  const auto before = static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(count_ - 2)));
  const double share = place - static_cast<double>(before);
  return points_px_[before] + share * (points_px_[before + 1] - points_px_[before]);
}

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
  if (!(ends[best] - ends[0] >= kBetterThanEnds && ends[best] - ends[count] >= kBetterThanEnds)) {
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

// At the edge of its window a step may lie further on: it is there at least, and nearer than the ridge's end.
std::optional<TubeEnd> sharpened(const TubeEnd& end, const ImageMeasurement& image,
                                 std::span<const Eigen::Vector2d> path_px, double half_width_px) {
  const auto place = static_cast<std::ptrdiff_t>(std::lround(end.place));
  const std::ptrdiff_t first = std::max<std::ptrdiff_t>(place - kStepOutside, 1);
  const auto seen = contrast_along(image, path_px, first, half_width_px);
  if (!seen) return std::nullopt;
  const StepSearch search(*seen);
  auto step = search.found();
  if (!step) return std::nullopt;
  step->place += static_cast<double>(first);
  const bool is_far_out = first > place - kStepOutside;
  if (is_far_out && !is_of_tube(image, path_px, step->place, half_width_px)) return std::nullopt;
  return step;
}

}  // namespace tubed
