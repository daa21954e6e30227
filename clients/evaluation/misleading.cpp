#include "clients/evaluation/misleading.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

/// Judges pairs of an estimated and a true point.
class Judgement {
 public:
  Judgement(const EstimatedShape& shape, const MisleadingLimits& limits) : shape_(shape), limits_(limits) {}

  void judge(const PolylinePlace& estimated, const Eigen::Vector3d& true_mm) {
    ++points_.judged;
    const Eigen::Vector3d e_mm = at_place(shape_.centreline.p_world_mm, estimated) - true_mm;
    const double off_mm = e_mm.norm();
    if (off_mm <= limits_.distance_mm) return;
    const Eigen::Vector3d u = e_mm / off_mm;
    const Eigen::Matrix3d covariance_mm2 = symmetric(at_place(shape_.covariance_world_mm2, estimated));
    const double sigma_mm = std::sqrt(std::max(u.dot(covariance_mm2 * u), 0.0));
    if (off_mm <= limits_.sigmas * sigma_mm) return;
    ++points_.misleading;
    points_.max_mm = std::max(points_.max_mm, off_mm);
  }
  [[nodiscard]] const MisleadingPoints& points() const { return points_; }

 private:
  const EstimatedShape& shape_;
  MisleadingLimits limits_;
  MisleadingPoints points_;
};

/// Where the estimate's polyline is at arc length s, its ends beyond them.
PolylinePlace place_at(const SampledCentreline& curve, double s_mm) {
  const auto above = std::upper_bound(curve.s_mm.begin(), curve.s_mm.end(), s_mm);
  if (above == curve.s_mm.begin()) return {};
  const auto left = static_cast<Eigen::Index>(above - curve.s_mm.begin()) - 1;
  if (above == curve.s_mm.end()) return {left, 0};
  return {left, (s_mm - *(above - 1)) / (*above - *(above - 1))};
}

}  // namespace

std::optional<MisleadingPoints> misleading_points(const EstimatedShape& shape, const SampledCentreline& truth,
                                                  const Camera& view, const ShapeErrorSettings& settings,
                                                  const MisleadingLimits& limits) {
  const SampledCentreline& estimate = shape.centreline;
  if (estimate.s_mm.size() < 2 || truth.s_mm.size() < 2 ||
      shape.covariance_world_mm2.cols() != estimate.p_world_mm.cols() ||
      !shape.covariance_world_mm2.allFinite()) {
    return std::nullopt;
  }
  const auto is_judged = [&](double s_mm, const Eigen::Vector3d& p_world_mm) {
    if (s_mm > settings.s_max_mm) return false;
    if (settings.part == JudgedPart::kAll) return true;
    const auto projection = view.project(p_world_mm);
    return projection && view.contains(projection->p_image_px);
  };
  Judgement judgement(shape, limits);
  for (Eigen::Index i = 0; i < truth.p_world_mm.cols(); ++i) {
    const double s_mm = truth.s_mm[static_cast<std::size_t>(i)];
    const Eigen::Vector3d true_mm = truth.p_world_mm.col(i);
    if (!is_judged(s_mm, true_mm)) continue;
    const bool nearest = settings.match == PointMatch::kNearest;
    judgement.judge(nearest ? closest_place_on(estimate.p_world_mm, true_mm) : place_at(estimate, s_mm),
                    true_mm);
  }
  for (Eigen::Index i = 0; settings.match == PointMatch::kNearest && i < estimate.p_world_mm.cols(); ++i) {
    const Eigen::Vector3d p_mm = estimate.p_world_mm.col(i);
    if (!is_judged(estimate.s_mm[static_cast<std::size_t>(i)], p_mm)) continue;
    judgement.judge({i, 0}, closest_point_on(truth.p_world_mm, p_mm));
  }
  if (judgement.points().judged == 0) return std::nullopt;
  return judgement.points();
}

MisleadingCount total_of(const std::map<Validity, MisleadingCount>& counts) {
  MisleadingCount total;
  for (const auto& [validity, count] : counts) {
    total.instants += count.instants;
    total.misleading += count.misleading;
  }
  return total;
}

}  // namespace tubed
