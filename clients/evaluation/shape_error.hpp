// How far an estimated centreline is from the true one at one instant: the metrics of the paper's Sec. 3.3.
// The paper names them without formulas ("RMS error" of what pairs of points?), so each choice made here is
// written down.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "idl/geometry/camera.hpp"

namespace tubed {

/// A centreline as points in order of arc length from the tip.
struct SampledCentreline {
  std::vector<double> s_mm;     ///< rising, one a point
  Eigen::Matrix3Xd p_world_mm;  ///< 3 x n, one point a column, tip first
};

/// Which point of the estimate a true point is compared with.
enum class PointMatch {
  kNearest,    ///< the closest point of the estimate's polyline: sliding along the catheter costs nothing
  kArcLength,  ///< the point at the same distance from the tip, or the estimate's end where it does not reach
               ///< as far
};
std::string_view name_of(PointMatch match);

/// Which points are judged.
enum class JudgedPart {
  kAll,     ///< everything up to s_max_mm
  kInView,  ///< of that, what the camera projects into its image, whether or not there were X-rays
};

struct ShapeErrorSettings {
  /// Both curves end here: up to the last coil of the paper's catheter. What lies behind it no coil holds.
  double s_max_mm = 370;
  PointMatch match = PointMatch::kNearest;
  JudgedPart part = JudgedPart::kAll;
};

/// The five rows of the paper's Table 1, mm.
struct ShapeError {
  /// Greatest distance of a judged point of either polyline, taken every 0.5 mm, from the other polyline
  /// (point to segment): symmetric, and the same for both matches.
  double hausdorff_mm = 0;
  double rms_mm = 0;            ///< of the distances of the judged true points from their partners
  double x_mm = 0;              ///< the same of the components along the camera's axes, x right,
  double y_mm = 0;              ///< .. y down,
  double z_mm = 0;              ///< .. z depth: rms^2 = x^2 + y^2 + z^2
  std::size_t point_count = 0;  ///< judged true points
};

/// Cameras that give the metrics their axes and their view.
struct ViewOfFrame {
  const Camera& axes;  ///< x, y, z of the errors
  const Camera& view;  ///< JudgedPart::kInView
};

/// Compares two curves at one instant. Nothing when one of them has fewer than two points up to s_max_mm or
/// no true point is judged.
std::optional<ShapeError> shape_error(const SampledCentreline& estimate, const SampledCentreline& truth,
                                      const ViewOfFrame& cameras, const ShapeErrorSettings& settings);

/// The part of a curve from its first point to `s_max_mm`; the last point is interpolated there when it lies
/// between two.
SampledCentreline up_to(const SampledCentreline& curve, double s_max_mm);

/// The point of the polyline at arc length s_mm, linear between its points, the end points beyond them.
/// Precondition: at least one point.
Eigen::Vector3d point_at(const SampledCentreline& curve, double s_mm);

/// A place on a polyline: between its points `left` and `left` + 1, with `share` of the latter.
struct PolylinePlace {
  Eigen::Index left = 0;
  double share = 0;
};

/// Of `columns` (m x n), one column a point of the polyline, what is at a place. Precondition: `place.left`
/// is a column, and `share` is 0 at the last one.
inline Eigen::VectorXd at_place(const Eigen::Ref<const Eigen::MatrixXd>& columns,
                                const PolylinePlace& place) {
  const Eigen::Index right = std::min(place.left + 1, columns.cols() - 1);
  return (1 - place.share) * columns.col(place.left) + place.share * columns.col(right);
}

/// Where the polyline through `points_mm` (3 x n, n >= 1) is closest to `p_mm`.
PolylinePlace closest_place_on(const Eigen::Matrix3Xd& points_mm, const Eigen::Vector3d& p_mm);

/// The point of the polyline through `points_mm` (3 x n, n >= 1) closest to `p_mm`.
Eigen::Vector3d closest_point_on(const Eigen::Matrix3Xd& points_mm, const Eigen::Vector3d& p_mm);

}  // namespace tubed
