#include "daemon/estimator/images/tube_marks.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/image/sample_vesselness.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kSigmaMark_px = 0.5;  // of all marks together, beside the shift's own
constexpr double kRemembered = 0.99;   // of what earlier images said of marks, with each new one
constexpr double kMinAsked = 30;
constexpr double kMissing = 0.1;
constexpr double kShortest_px_per_mm = 0.2;  // below, a piece of tube lies along the rays
constexpr int kTipDirection = 3;             // lines over which the tip's direction is taken

}  // namespace

TubeMarks::TubeMarks(const std::vector<double>& marks_mm, double mark_length_mm)
    : search_(marks_mm, mark_length_mm), darkness_(search_.samples()) {}

Eigen::Vector2d FoundPath::at(double s_mm) const {
  const auto found = [this](int line) -> Eigen::Vector2d {
    const CorrespondenceLine& of = lines[static_cast<std::size_t>(line)];
    return of.base_px + of.offset_px * of.normal;
  };
  const double place =
      std::clamp(s_mm / layout.spacing_mm, -1e3, static_cast<double>(layout.count - 1) - 1e-6);
  if (place < 0) {
    return found(0) + place / kTipDirection * (found(kTipDirection) - found(0));
  }
  const int before = static_cast<int>(place);
  return found(before) + (place - before) * (found(before + 1) - found(before));
}

// How much darker than beside it the tube is along itself (brighter, where tubes are bright). False where not
// all of that is in view, or the tube points at the source.
bool TubeMarks::read_darkness(const ImageMeasurement& image, const FoundPath& path) {
  const LineLayout& layout = path.layout;
  if (search_.until_mm() + 1 > layout.s_mm(layout.count - 1)) {
    return false;  // no shaft behind the marks to take the noise from
  }
  const int last = std::min(static_cast<int>((search_.until_mm() + 1) / layout.spacing_mm) + 2, layout.count);
  for (int i = 0; i < last; ++i) {
    if (!path.lines[static_cast<std::size_t>(i)].in_view) {
      return false;
    }
  }
  if ((path.at(0) - path.at(search_.marks_mm().back())).norm() <
      kShortest_px_per_mm * search_.marks_mm().back()) {
    return false;
  }
  const float sign = image.polarity == RidgePolarity::kDark ? 1.0F : -1.0F;
  for (std::size_t k = 0; k < darkness_.size(); ++k) {
    const double s_mm = search_.from_mm() + MarkSearch::kStep_mm * static_cast<double>(k);
    const Eigen::Vector2d p_px = path.at(s_mm);
    const Eigen::Vector2d along = path.at(s_mm + 1) - path.at(s_mm - 1);
    const Eigen::Vector2d normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
    const double half_px = path.lines[static_cast<std::size_t>(std::clamp(
                                          static_cast<int>(s_mm / layout.spacing_mm), 0, last - 1))]
                               .half_width_px;
    const auto grey = [&](double across_px) {
      return sample_map(image, image.grey, p_px + across_px * normal);
    };
    const float centre = (grey(-half_px / 2) + grey(0) + grey(half_px / 2)) / 3;
    float sides = 0;
    for (const double beyond_px : {2.0, 3.0}) sides += grey(-half_px - beyond_px) + grey(half_px + beyond_px);
    darkness_[k] = sign * (sides / 4 - centre);
  }
  return true;
}

bool TubeMarks::are_missing() const { return asked_ > kMinAsked && found_ < kMissing * asked_; }

int TubeMarks::measure(const ImageMeasurement& image, const FoundPath& path, std::span<LineConstraint> room) {
  if (!search_.can_find() || !read_darkness(image, path)) {
    return 0;
  }
  const auto found = search_.find(darkness_);
  asked_ = kRemembered * asked_ + 1;
  found_ = kRemembered * found_ + (found ? 1 : 0);
  if (!found) {
    return 0;
  }
  int written = 0;
  const auto count = static_cast<double>(search_.marks_mm().size());
  for (const double mark_mm : search_.marks_mm()) {
    const double seen_mm = mark_mm + found->shift_mm;
    const Eigen::Vector2d tipward = path.at(seen_mm - 1) - path.at(seen_mm + 1);
    const double px_per_mm = tipward.norm() / 2;
    const double variance = squared(found->sigma_mm * px_per_mm) + squared(kSigmaMark_px);
    room[static_cast<std::size_t>(written++)] = {mark_mm, path.at(seen_mm), tipward.normalized(),
                                                 count * variance};
  }
  return written;
}

}  // namespace tubed
