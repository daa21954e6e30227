// Correspondence lines laid across a tube's projection.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/image_area.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

using CorrespondenceLines = std::array<CorrespondenceLine, LineSearch::kMaxLines>;

/// How lines lie along a tube: the first at the tip, the last at length_mm, about 2 mm apart.
struct LineLayout {
  explicit LineLayout(double length_mm);

  int count;
  double spacing_mm;
  [[nodiscard]] double s_mm(int line) const { return line * spacing_mm; }
};

/// Sets base, normal, half width and in_view of the first layout.count lines for the tube with coefficients C
/// (3 x n, mm, world). A line is in view when its base lies at least 3 px inside the image and in no
/// mask of the camera's, and the tube does not run straight toward the source there. `radius_mm` is the
/// tube's. Returns how many are in view; never allocates.
int project_lines(const Camera& camera, const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C,
                  const LineLayout& layout, double radius_mm, CorrespondenceLines& lines);

/// Adds what is read of an image when the first layout.count lines are searched `reach_px` to either side,
/// and around the first one, the tip, `beyond_tip_px` further. Lines that are not in view are passed over.
void add_lines(const CorrespondenceLines& lines, const LineLayout& layout, int reach_px, double beyond_tip_px,
               ImageArea& area);

/// Takes out of view those of the lines for which not all of that lies in `measured`; how many.
int drop_unmeasured_lines(const ImageArea& measured, const LineLayout& layout, int reach_px,
                          double beyond_tip_px, CorrespondenceLines& lines);

/// Takes out of view those of the lines where no tube could be seen, behind a blade of the collimator or
/// outside an image intensifier's circle: where more than half of the pixels across, there or 4 px before or
/// behind, are the darkest of the image (the brightest, where tubes are bright), within 2 % of its range. How
/// many.
int drop_blind_lines(const ImageMeasurement& image, const LineLayout& layout, int reach_px,
                     CorrespondenceLines& lines);

/// Change of the offset from one line of such a layout to the next that LineSearch is told to expect, px.
inline constexpr double kLineTransition_px = 0.6;

}  // namespace tubed
