#include "clients/evaluation/shape_error.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace tubed {

namespace {

// The greatest distance is looked for at points so dense on each polyline; it can be missed by half a step at
// most (a distance changes no faster than the point moves), and by far less where the other curve is smooth.
constexpr double kHausdorffStepMm = 0.5;

using Judge = std::function<bool(const Eigen::Vector3d& p_world_mm)>;

Judge judge_of(JudgedPart part, const Camera& view) {
  if (part == JudgedPart::kAll) return [](const Eigen::Vector3d&) { return true; };
  return [&view](const Eigen::Vector3d& p_world_mm) {
    const auto projection = view.project(p_world_mm);
    return projection && view.contains(projection->p_image_px);
  };
}

/// The greatest distance of a judged point of the polyline `from` to the polyline `to`; 0 when none is
/// judged.
double directed_hausdorff_mm(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, const Judge& judged) {
  double max_mm = 0;
  const auto look_at = [&](const Eigen::Vector3d& p_mm) {
    if (judged(p_mm)) max_mm = std::max(max_mm, (closest_point_on(to, p_mm) - p_mm).norm());
  };
  for (Eigen::Index i = 0; i + 1 < from.cols(); ++i) {
    const Eigen::Vector3d step_mm = from.col(i + 1) - from.col(i);
    const int pieces = std::max(1, static_cast<int>(std::ceil(step_mm.norm() / kHausdorffStepMm)));
    for (int k = 0; k < pieces; ++k) look_at(from.col(i) + step_mm * (static_cast<double>(k) / pieces));
  }
  look_at(from.rightCols<1>());
  return max_mm;
}

Eigen::Vector3d partner_of(const SampledCentreline& estimate, const SampledCentreline& truth, Eigen::Index i,
                           PointMatch match) {
  if (match == PointMatch::kArcLength) return point_at(estimate, truth.s_mm[static_cast<std::size_t>(i)]);
  return closest_point_on(estimate.p_world_mm, truth.p_world_mm.col(i));
}

}  // namespace

std::string_view name_of(PointMatch match) { return match == PointMatch::kNearest ? "nearest" : "arc"; }

PolylinePlace closest_place_on(const Eigen::Matrix3Xd& points_mm, const Eigen::Vector3d& p_mm) {
  PolylinePlace closest;
  double min_mm2 = (points_mm.col(0) - p_mm).squaredNorm();
  for (Eigen::Index i = 0; i + 1 < points_mm.cols(); ++i) {
    const Eigen::Vector3d a_mm = points_mm.col(i);
    const Eigen::Vector3d step_mm = points_mm.col(i + 1) - a_mm;
    const double length_mm2 = step_mm.squaredNorm();
    const double along = length_mm2 > 0 ? std::clamp(step_mm.dot(p_mm - a_mm) / length_mm2, 0.0, 1.0) : 0.0;
    const double distance_mm2 = (a_mm + along * step_mm - p_mm).squaredNorm();
    if (distance_mm2 < min_mm2) {
      min_mm2 = distance_mm2;
      closest = {i, along};
    }
  }
  return closest;
}

Eigen::Vector3d closest_point_on(const Eigen::Matrix3Xd& points_mm, const Eigen::Vector3d& p_mm) {
  const PolylinePlace place = closest_place_on(points_mm, p_mm);
  const Eigen::Vector3d a_mm = points_mm.col(place.left);
  if (place.share == 0) return a_mm;
  const Eigen::Vector3d step_mm = points_mm.col(place.left + 1) - a_mm;
  return a_mm + place.share * step_mm;
}

Eigen::Vector3d point_at(const SampledCentreline& curve, double s_mm) {
  const auto above = std::upper_bound(curve.s_mm.begin(), curve.s_mm.end(), s_mm);
  if (above == curve.s_mm.begin()) return curve.p_world_mm.leftCols<1>();
  if (above == curve.s_mm.end()) return curve.p_world_mm.rightCols<1>();
  const auto k = static_cast<Eigen::Index>(above - curve.s_mm.begin());
  const double share = (s_mm - *(above - 1)) / (*above - *(above - 1));
  return (1 - share) * curve.p_world_mm.col(k - 1) + share * curve.p_world_mm.col(k);
}

SampledCentreline up_to(const SampledCentreline& curve, double s_max_mm) {
  const auto end = std::upper_bound(curve.s_mm.begin(), curve.s_mm.end(), s_max_mm);
  const auto count = static_cast<Eigen::Index>(end - curve.s_mm.begin());
  SampledCentreline part{{curve.s_mm.begin(), end}, curve.p_world_mm.leftCols(count)};
  if (count > 0 && end != curve.s_mm.end() && part.s_mm.back() < s_max_mm) {
    part.s_mm.push_back(s_max_mm);
    part.p_world_mm.conservativeResize(Eigen::NoChange, count + 1);
    part.p_world_mm.col(count) = point_at(curve, s_max_mm);
  }
  return part;
}

std::optional<ShapeError> shape_error(const SampledCentreline& estimate, const SampledCentreline& truth,
                                      const ViewOfFrame& cameras, const ShapeErrorSettings& settings) {
  const SampledCentreline estimated = up_to(estimate, settings.s_max_mm);
  const SampledCentreline real = up_to(truth, settings.s_max_mm);
  if (estimated.s_mm.size() < 2 || real.s_mm.size() < 2) return std::nullopt;

  const Judge judged = judge_of(settings.part, cameras.view);
  const Eigen::Matrix3d R_camera_world = cameras.axes.calibration().T_camera_world.linear();
  Eigen::Vector3d squares_mm2 = Eigen::Vector3d::Zero();
  ShapeError error;
  for (Eigen::Index i = 0; i < real.p_world_mm.cols(); ++i) {
    const Eigen::Vector3d p_world_mm = real.p_world_mm.col(i);
    if (!judged(p_world_mm)) continue;
    const Eigen::Vector3d off_camera_mm =
        R_camera_world * (partner_of(estimated, real, i, settings.match) - p_world_mm);
    squares_mm2 += off_camera_mm.cwiseAbs2();
    ++error.point_count;
  }
  if (error.point_count == 0) return std::nullopt;

  const Eigen::Vector3d rms_camera_mm = (squares_mm2 / static_cast<double>(error.point_count)).cwiseSqrt();
  error.rms_mm = rms_camera_mm.norm();
  error.x_mm = rms_camera_mm.x();
  error.y_mm = rms_camera_mm.y();
  error.z_mm = rms_camera_mm.z();
  // Hausdorff: the greatest distance of either curve's points from the other curve, so that a part that is
  // missing and a part that was invented both count.
  error.hausdorff_mm = std::max(directed_hausdorff_mm(real.p_world_mm, estimated.p_world_mm, judged),
                                directed_hausdorff_mm(estimated.p_world_mm, real.p_world_mm, judged));
  return error;
}

}  // namespace tubed
