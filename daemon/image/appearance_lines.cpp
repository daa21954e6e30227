#include "daemon/image/appearance_lines.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/image/sample_vesselness.hpp"

namespace tubed {

namespace {

constexpr double kMinAgreeingToLearn = 0.62;  // share of lines on which a first look may be learnt
constexpr double kSlowShare = 0.05;           // of one trusted image
constexpr std::array<double, 3> kContours = {0.5, 0.25, 0};  // epsilon in turn, of the reach
constexpr double kNarrowContour_px = 1.5;
constexpr int kStepsEach = 8;
constexpr double kLoner_px = 2.0;  // farther from what its neighbours found, a line has found something else
constexpr int kNeighbours = 3;     // to either side
constexpr double kUnknown_px2 = 1e4;  // variance where the band says nothing

/// Median offset of a line's neighbours and its own.
double usual_offset_px(const CorrespondenceLines& lines, int count, int line) {
  std::array<double, 2 * kNeighbours + 1> offsets{};
  std::size_t taken = 0;
  for (int i = std::max(0, line - kNeighbours); i <= std::min(count - 1, line + kNeighbours); ++i) {
    if (lines[static_cast<std::size_t>(i)].in_view) {
      offsets[taken++] = lines[static_cast<std::size_t>(i)].offset_px;
    }
  }
  const auto middle = offsets.begin() + static_cast<std::ptrdiff_t>(taken / 2);
  std::nth_element(offsets.begin(), middle, offsets.begin() + static_cast<std::ptrdiff_t>(taken));
  return *middle;
}

/// No chain holds the lines of Eq. (16) together.
void doubt_loners(CorrespondenceLines& lines, int count, int reach_px) {
  for (int i = 0; i < count; ++i) {
    CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    if (line.in_view && std::abs(line.offset_px - usual_offset_px(lines, count, i)) > kLoner_px) {
      line.variance_px2 = std::max(line.variance_px2, reach_px * reach_px / 3.0);
    }
  }
}

}  // namespace

LineAppearance::LineAppearance() {
  pixels_.reserve(static_cast<std::size_t>(LineSearch::kMaxLines) *
                  static_cast<std::size_t>(2 * LineSearch::kMaxReach + 1));
}

LineSearch::Outcome LineAppearance::begin(const ImageMeasurement& image, CorrespondenceLines& lines,
                                          int count, int reach_px, LineSearch& search) {
  const LineSearch::Outcome outcome = search.search(image, lines, count, reach_px, kLineTransition_px);
  if (outcome.inlier_ratio >= kMinAgreeingToLearn) {
    remember(lines, count, reach_px);
    learn(image, 1);
  }
  return outcome;
}

void LineAppearance::remember(const CorrespondenceLines& lines, int count, int reach_px) {
  std::copy_n(lines.begin(), count, found_.begin());
  count_ = count;
  reach_px_ = reach_px;
}

void LineAppearance::learn(const ImageMeasurement& image, double share) {
  pixels_.clear();
  for (const CorrespondenceLine& line : std::span(found_).first(static_cast<std::size_t>(count_))) {
    if (!line.in_view || !line.agrees) continue;
    for (int k = -reach_px_; k <= reach_px_; ++k) {
      const Eigen::Vector2d p = (line.base_px + k * line.normal).array().round();
      if (p.x() < 0 || p.y() < 0 || p.x() > image.width - 1 || p.y() > image.height - 1) continue;
      const auto index = static_cast<std::size_t>(p.y()) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(p.x());
      pixels_.push_back({index, static_cast<float>(line.half_width_px - std::abs(k - line.offset_px))});
    }
  }
  model_.learn(image, pixels_, share);
}

void LineAppearance::trust(const ImageMeasurement& image) {
  if (count_ == 0) return;
  learn(image, confirmed_ ? kSlowShare : 1);
  confirmed_ = model_.learned();
}

void LineAppearance::distrust() {
  if (!confirmed_) forget();
}

void LineAppearance::forget() {
  model_.forget();
  count_ = 0;
  confirmed_ = false;
}

LineSearch::Outcome PosteriorLikelihood::find(const ImageMeasurement& image, CorrespondenceLines& lines,
                                              int count, int reach_px, LineSearch::Among /*among*/) {
  if (!appearance_.model().learned()) {
    const LineSearch::Outcome outcome = appearance_.begin(image, lines, count, reach_px, search_);
    if (!appearance_.model().learned()) return outcome;
  }
  const LineSearch::Outcome outcome =
      search_.search(image, appearance_.model(), lines, count, reach_px, kLineTransition_px);
  appearance_.remember(lines, count, reach_px);
  return outcome;
}

void BandPixelLikelihood::place_path(const CorrespondenceLines& lines, int count) {
  path_.resize(static_cast<std::size_t>(count));
  normals_.resize(2, count);
  for (std::size_t i = 0; i < path_.size(); ++i) {
    const CorrespondenceLine& line = lines[i];
    normals_.col(static_cast<Eigen::Index>(i)) = line.normal;
    path_[i].p_px = line.in_view ? Eigen::Vector2d(line.base_px + line.offset_px * line.normal)
                                 : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    path_[i].half_width_px = line.half_width_px;
  }
}

void BandPixelLikelihood::step(CorrespondenceLines& lines, int count, int reach_px, double epsilon_px) {
  place_path(lines, count);
  band_.log_likelihood(path_, epsilon_px, &derivatives_);
  offsets_.resize(path_.size());
  offsets_along(derivatives_, normals_, offsets_);
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    CorrespondenceLine& line = lines[i];
    if (!line.in_view) continue;
    const double step_px = std::clamp(offsets_[i].offset_px, -epsilon_px, epsilon_px);
    line.offset_px = std::clamp<double>(line.offset_px + step_px, -reach_px, reach_px);
    line.variance_px2 = std::min(offsets_[i].variance_px2, kUnknown_px2);
  }
}

LineSearch::Outcome BandPixelLikelihood::find(const ImageMeasurement& image, CorrespondenceLines& lines,
                                              int count, int reach_px, LineSearch::Among /*among*/) {
  if (!appearance_.model().learned()) {
    const LineSearch::Outcome outcome = appearance_.begin(image, lines, count, reach_px, search_);
    if (!appearance_.model().learned()) return outcome;
  }
  for (CorrespondenceLine& line : lines) line.offset_px = 0;
  place_path(lines, count);
  double widest_px = 0;
  for (const PathVertex& vertex : path_) widest_px = std::max(widest_px, vertex.half_width_px);
  band_.choose_band(image, path_, std::max(1.0, reach_px - widest_px), appearance_.model(), PathEnd::kGoesOn);
  for (const double contour : kContours) {
    for (int k = 0; k < kStepsEach; ++k) {
      step(lines, count, reach_px, std::max(contour * reach_px, kNarrowContour_px));
    }
  }
  doubt_loners(lines, count, reach_px);
  const LineSearch::Outcome outcome = search_.judge(image, appearance_.model(), lines, count, reach_px);
  appearance_.remember(lines, count, reach_px);
  return outcome;
}

}  // namespace tubed
