#include "daemon/image/projected_lines.hpp"

#include <algorithm>

namespace tubed {

namespace {

constexpr double kSpacing_mm = 2.0;
constexpr double kViewMargin_px = 3.0;
constexpr double kShortest_px_per_mm = 0.2;  // below, a tube has no side to look to

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
    line.in_view = projection && camera.contains(projection->p_image_px, kViewMargin_px);
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

}  // namespace tubed
