#include "daemon/image/projected_lines.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr double kSpacing_mm = 2.0;
constexpr double kViewMargin_px = 3.0;
constexpr double kBlindMargin_px = 4.0;      // before and behind a line: so far the edge looks like a ridge
constexpr float kBlindShare = 0.02F;         // of the image's range of grey
constexpr double kShortest_px_per_mm = 0.2;  // below, a tube has no side to look to

/// All that is read of an image for one line.
struct LineBox {
  Eigen::Vector2d low_px;
  Eigen::Vector2d high_px;
};

LineBox box_of(const CorrespondenceLine& line, int number, int reach_px, double beyond_tip_px) {
  constexpr double kBetweenPixels_px = 1;
  const double further_px = kBetweenPixels_px + (number == 0 ? beyond_tip_px : 0);
  const Eigen::Vector2d half = (reach_px * line.normal).cwiseAbs().array() + further_px;
  return {line.base_px - half, line.base_px + half};
}

/// Where an image cannot show a tube: it is as dark there as anywhere, or as bright if tubes are bright.
class BlindPixels {
 public:
  explicit BlindPixels(const ImageMeasurement& image)
      : image_(image),
        sign_(image.polarity == RidgePolarity::kDark ? 1.0F : -1.0F),
        limit_(sign_ > 0 ? image.darkest : -image.brightest) {
    limit_ += kBlindShare * (image.brightest - image.darkest);
  }

  /// Of an even image nobody knows which end of its greys it is.
  [[nodiscard]] bool are_known() const { return image_.brightest > image_.darkest; }

  /// Beyond the image as well.
  [[nodiscard]] bool contain(const Eigen::Vector2d& p_px) const {
    const Eigen::Array2d p = p_px.array() + 0.5;  // cut off below: the nearest pixel
    if (!(p.x() >= 0 && p.y() >= 0 && p.x() < image_.width && p.y() < image_.height)) {
      return true;
    }
    return is_dark(static_cast<int>(p.x()), static_cast<int>(p.y()));
  }

  /// Whether more than `most` of the pixels at first_px + k step_px, k = 0 .. count - 1, are so.
  [[nodiscard]] bool are_more_than(int most, const Eigen::Vector2d& first_px, const Eigen::Vector2d& step_px,
                                   int count) const {
    const Eigen::Vector2d last_px = first_px + (count - 1) * step_px;
    const bool is_inside = is_well_inside(first_px) && is_well_inside(last_px);
    int blind = 0;
    // Not further than it may still become so many.
    for (int k = 0; k < count && blind <= most && blind + count - k > most; ++k) {
      const Eigen::Vector2d p_px = first_px + k * step_px;
      const bool is_blind = is_inside
                                ? is_dark(static_cast<int>(p_px.x() + 0.5), static_cast<int>(p_px.y() + 0.5))
                                : contain(p_px);
      blind += is_blind ? 1 : 0;
    }
    return blind > most;
  }

 private:
  /// By half a pixel at least, so that rounding along a line stays inside.
  [[nodiscard]] bool is_well_inside(const Eigen::Vector2d& p_px) const {
    return p_px.x() >= 0 && p_px.y() >= 0 && p_px.x() < image_.width - 1 && p_px.y() < image_.height - 1;
  }

  [[nodiscard]] bool is_dark(int x_px, int y_px) const {
    const auto index = static_cast<std::size_t>(y_px) * static_cast<std::size_t>(image_.width) +
                       static_cast<std::size_t>(x_px);
    return sign_ * image_.grey[index] <= limit_;
  }

  const ImageMeasurement& image_;
  float sign_;
  float limit_;  ///< sign_ times the grey value
};

/// More than half of what lies across the tube, there or a little before or behind.
bool is_blind(const BlindPixels& blind, const CorrespondenceLine& line, int reach_px) {
  const Eigen::Vector2d along(line.normal.y(), -line.normal.x());
  const Eigen::Vector2d first_px = line.base_px - reach_px * line.normal;
  return std::ranges::any_of(std::array{0.0, -kBlindMargin_px, kBlindMargin_px}, [&](double shift_px) {
    return blind.are_more_than(reach_px, first_px + shift_px * along, line.normal, 2 * reach_px + 1);
  });
}

}  // namespace

LineLayout::LineLayout(double length_mm)
    : count(std::min(LineSearch::kMaxLines, static_cast<int>(length_mm / kSpacing_mm) + 1)),
      spacing_mm(length_mm / (count - 1)) {}

int project_lines(const Camera& camera, const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C,
                  const LineLayout& layout, double radius_mm, CorrespondenceLines& lines) {
  int in_view = 0;
  for (int i = 0; i < layout.count; ++i) {
    CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    const CubicBasis basis = spline.basis(layout.s_mm(i));
    const auto projection = camera.project(combine(C, basis.first, basis.value));
    line.expected_variance_px2 = 0;
    line.in_view = projection && camera.contains(projection->p_image_px, kViewMargin_px) &&
                   !is_masked(camera.calibration(), projection->p_image_px);
    if (!line.in_view) {
      continue;
    }
    const Eigen::Vector2d along = projection->J_image_world * combine(C, basis.first, basis.first_derivative);
    const double length = along.norm();
    line.in_view = length > kShortest_px_per_mm;
    line.base_px = projection->p_image_px;
    line.normal = Eigen::Vector2d(-along.y(), along.x()) / std::max(length, 1e-9);
    line.half_width_px = radius_mm * camera.calibration().fx / projection->depth_mm;
    in_view += line.in_view ? 1 : 0;
  }
  return in_view;
}

void add_lines(const CorrespondenceLines& lines, const LineLayout& layout, int reach_px, double beyond_tip_px,
               ImageArea& area) {
  for (int i = 0; i < layout.count; ++i) {
    const CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    if (!line.in_view) {
      continue;
    }
    LineBox box = box_of(line, i, reach_px, beyond_tip_px);
    // What lies between it and the next one is read where the tube's end is sought.
    if (i + 1 < layout.count && lines[static_cast<std::size_t>(i) + 1].in_view) {
      const LineBox next = box_of(lines[static_cast<std::size_t>(i) + 1], i + 1, reach_px, beyond_tip_px);
      box = {box.low_px.cwiseMin(next.low_px), box.high_px.cwiseMax(next.high_px)};
    }
    area.add_box(box.low_px, box.high_px);
  }
}

int drop_unmeasured_lines(const ImageArea& measured, const LineLayout& layout, int reach_px,
                          double beyond_tip_px, CorrespondenceLines& lines) {
  int dropped = 0;
  for (int i = 0; i < layout.count; ++i) {
    CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    if (line.in_view) {
      const LineBox box = box_of(line, i, reach_px, beyond_tip_px);
      line.in_view = measured.covers_box(box.low_px, box.high_px);
      dropped += line.in_view ? 0 : 1;
    }
  }
  return dropped;
}

int drop_blind_lines(const ImageMeasurement& image, const LineLayout& layout, int reach_px,
                     CorrespondenceLines& lines) {
  const BlindPixels blind(image);
  int dropped = 0;
  for (CorrespondenceLine& line : std::span(lines).first(static_cast<std::size_t>(layout.count))) {
    if (line.in_view && blind.are_known() && is_blind(blind, line, reach_px)) {
      line.in_view = false;
      ++dropped;
    }
  }
  return dropped;
}

}  // namespace tubed
