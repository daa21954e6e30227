// Marks along the tube, read in the image where the lines have found it.
#include <algorithm>
#include <cmath>

#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/image/sample_vesselness.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kSigmaMark_px = 0.5;  // of all marks together, beside the shift's own
constexpr double kRemembered = 0.99;   // of what earlier images said of marks, with each new one
constexpr double kMinAsked = 30;
constexpr double kMissing = 0.1;

}  // namespace

// On the path that the lines have found, before the tip straight on.
Eigen::Vector2d TubeViews::found_px(double s_mm) const {
  const auto found = [this](int line) -> Eigen::Vector2d {
    const CorrespondenceLine& of = lines_[static_cast<std::size_t>(line)];
    return of.base_px + of.offset_px * of.normal;
  };
  const double place =
      std::clamp(s_mm / layout_.spacing_mm, -1e3, static_cast<double>(layout_.count - 1) - 1e-6);
  if (place < 0) {
    return found(0) + place / kTipDirection * (found(kTipDirection) - found(0));
  }
  const int before = static_cast<int>(place);
  return found(before) + (place - before) * (found(before + 1) - found(before));
}

// How much darker than beside it the tube is along itself (brighter, where tubes are bright). False where not
// all of that is in view, or the tube points at the source.
bool TubeViews::read_darkness(const ImageMeasurement& image) {
  if (marks_.until_mm() + 1 > layout_.s_mm(layout_.count - 1)) {
    return false;  // no shaft behind the marks to take the noise from
  }
  const int last =
      std::min(static_cast<int>((marks_.until_mm() + 1) / layout_.spacing_mm) + 2, layout_.count);
  for (int i = 0; i < last; ++i) {
    if (!lines_[static_cast<std::size_t>(i)].in_view) {
      return false;
    }
  }
  if ((found_px(0) - found_px(marks_.marks_mm().back())).norm() <
      kShortest_px_per_mm * marks_.marks_mm().back()) {
    return false;
  }
  const float sign = image.polarity == RidgePolarity::kDark ? 1.0F : -1.0F;
  for (std::size_t k = 0; k < darkness_.size(); ++k) {
    const double s_mm = marks_.from_mm() + MarkSearch::kStep_mm * static_cast<double>(k);
    const Eigen::Vector2d p_px = found_px(s_mm);
    const Eigen::Vector2d along = found_px(s_mm + 1) - found_px(s_mm - 1);
    const Eigen::Vector2d normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
    const double half_px =
        lines_[static_cast<std::size_t>(std::clamp(static_cast<int>(s_mm / layout_.spacing_mm), 0, last - 1))]
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

bool TubeViews::marks_are_missing() const {
  return marks_asked_ > kMinAsked && marks_found_ < kMissing * marks_asked_;
}

// Each mark that is where the pattern is says how far along itself the tube lies.
void TubeViews::measure_marks(const ImageMeasurement& image, View& view) {
  if (!marks_.can_find() || !read_darkness(image)) {
    return;
  }
  const auto found = marks_.find(darkness_);
  marks_asked_ = kRemembered * marks_asked_ + 1;
  marks_found_ = kRemembered * marks_found_ + (found ? 1 : 0);
  if (!found) {
    return;
  }
  const auto count = static_cast<double>(marks_.marks_mm().size());
  for (const double mark_mm : marks_.marks_mm()) {
    const double seen_mm = mark_mm + found->shift_mm;
    const Eigen::Vector2d tipward = found_px(seen_mm - 1) - found_px(seen_mm + 1);
    const double px_per_mm = tipward.norm() / 2;
    const double variance = squared(found->sigma_mm * px_per_mm) + squared(kSigmaMark_px);
    view.measured[static_cast<std::size_t>(view.count++)] = {mark_mm, found_px(seen_mm), tipward.normalized(),
                                                             count * variance};
  }
}

}  // namespace tubed
