#include "clients/calibration/fit_choice.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "clients/calibration/tail_probability.hpp"

namespace tubed {

namespace {

constexpr double kMaxSigmas = 4.5;

std::vector<PointView> with_poses(std::vector<PointView> views, const CameraFit& fit) {
  for (std::size_t i = 0; i < views.size(); ++i) views[i].T_camera_world = fit.views[i].T_camera_world;
  return views;
}

/// Median of the residuals' lengths as the standard deviation along one axis, in sigmas of the points.
double robust_sigma(const CameraFit& fit, const std::vector<PointView>& views) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t k = 0; k < views[i].points.size(); ++k) {
      lengths.push_back(fit.views[i].residual_px[k].norm() / views[i].points[k].sigma_px);
    }
  }
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle / 1.1774;  // Rayleigh's distribution
}

/// Takes points out of `views` that are off by too much; true when there were any.
bool leave_out(const CameraFit& fit, std::vector<PointView>& views, std::vector<LeftOutPoint>& left_out) {
  const double limit = kMaxSigmas * robust_sigma(fit, views);
  bool were_any = false;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<CameraPoint> kept;
    for (std::size_t k = 0; k < views[i].points.size(); ++k) {
      const CameraPoint& point = views[i].points[k];
      const double residual_px = fit.views[i].residual_px[k].norm();
      if (residual_px / point.sigma_px <= limit) {
        kept.push_back(point);
      } else {
        left_out.push_back({i, point, residual_px});
        were_any = true;
      }
    }
    views[i].points = std::move(kept);
  }
  return were_any;
}

IntrinsicsModel plainest(const CameraPrior& prior) {
  IntrinsicsModel model;
  model.focal = !prior.focal_px;
  model.principal_point = true;
  model.principal_sigma_px = prior.principal_sigma * prior.width;
  return model;
}

Intrinsics in_the_middle(Intrinsics first, const CameraPrior& prior) {
  first.cx = (prior.width - 1) / 2.0;
  first.cy = (prior.height - 1) / 2.0;
  if (prior.focal_px) first.fx = *prior.focal_px;
  return first;
}

/// With everything, and with what is known of it.
IntrinsicsModel fullest(const CameraPrior& prior, double fx) {
  IntrinsicsModel model = plainest(prior);
  model.aspect = true;
  model.aspect_sigma = prior.aspect_sigma;
  model.distortion_terms = 5;
  const double r2 = (std::pow(prior.width / 2.0, 2) + std::pow(prior.height / 2.0, 2)) / (fx * fx);
  const auto& [k1, k2, k3] = prior.radial_sigma;
  model.distortion_sigma = {k1 / r2, k2 / (r2 * r2), prior.tangential_sigma, prior.tangential_sigma,
                            k3 / (r2 * r2 * r2)};
  return model;
}

/// The plainest model, unless distortion takes more from the residuals than it does by chance: for a noise
/// that is not known the likelihood ratio is n ln(chi2 / chi2'), chi-square of as many numbers as are added.
std::optional<IntrinsicsModel> model_for(const Intrinsics& first, const std::vector<PointView>& views,
                                         const CameraPrior& prior) {
  constexpr double kByChance = 0.02;
  const IntrinsicsModel plain = plainest(prior);
  const auto without = refine_camera(first, views, plain, Residuals::kSquared);
  const bool has_plain = without && without->degrees_of_freedom >= 4;
  if (!prior.may_distort) return has_plain ? std::optional(plain) : std::nullopt;
  const IntrinsicsModel full = fullest(prior, first.fx);
  const auto with = refine_camera(first, views, full, Residuals::kSquared);
  const bool has_full = with && with->degrees_of_freedom >= 4;
  if (!has_plain || !has_full)
    return has_plain ? std::optional(plain) : has_full ? std::optional(full) : std::nullopt;
  const double n = without->degrees_of_freedom + 1.0;
  const double gain = n * std::log(std::max(without->chi2, 1e-12) / std::max(with->chi2, 1e-12));
  return chi_square_tail(gain, full.count() - plain.count()) < kByChance ? full : plain;
}

}  // namespace

std::optional<ChosenFit> choose_fit(const Intrinsics& first, const std::vector<PointView>& views,
                                    const CameraPrior& prior) {
  const Intrinsics start = in_the_middle(first, prior);
  // With all of the usual distortion, so that it makes no good point look bad.
  const IntrinsicsModel rich = prior.may_distort ? fullest(prior, start.fx) : plainest(prior);
  std::optional<CameraFit> rough = refine_camera(start, views, rich, Residuals::kRobust);
  if (!rough) rough = refine_camera(start, views, plainest(prior), Residuals::kRobust);
  if (!rough) return std::nullopt;
  ChosenFit chosen;
  chosen.views = with_poses(views, *rough);
  leave_out(*rough, chosen.views, chosen.left_out);
  constexpr int kMaxRounds = 6;
  for (int round = 0; round < kMaxRounds; ++round) {
    const auto model = model_for(in_the_middle(rough->intrinsics, prior), chosen.views, prior);
    if (!model) return std::nullopt;
    chosen.model = *model;
    const auto fit = fit_camera(in_the_middle(rough->intrinsics, prior), chosen.views, chosen.model);
    if (!fit) return std::nullopt;
    chosen.fit = *fit;
    chosen.views = with_poses(chosen.views, *fit);
    std::vector<PointView> kept = chosen.views;
    if (round + 1 == kMaxRounds || !leave_out(*fit, kept, chosen.left_out)) break;
    chosen.views = std::move(kept);
  }
  const double prior_sigma_px = *chosen.model.principal_sigma_px;
  const double sigma_px = std::max(chosen.fit.sigma_of(2), chosen.fit.sigma_of(3));
  chosen.is_principal_point_held = sigma_px > 0.8 * prior_sigma_px;
  chosen.principal_offset_in_sigmas = std::hypot(chosen.fit.intrinsics.cx - (prior.width - 1) / 2.0,
                                                 chosen.fit.intrinsics.cy - (prior.height - 1) / 2.0) /
                                      prior_sigma_px;
  return chosen;
}

bool ResidualPattern::has_s_distortion() const {
  constexpr double kMinSigmas = 5;
  constexpr double kMinDisplacement_px = 0.1;
  return std::abs(s_distortion_in_sigmas) > kMinSigmas && std::abs(s_distortion_px) > kMinDisplacement_px;
}

ResidualPattern residual_pattern(const ChosenFit& chosen) {
  ResidualPattern pattern;
  const Eigen::Vector2d middle(chosen.fit.intrinsics.cx, chosen.fit.intrinsics.cy);
  double together = 0, squares = 0, count = 0, reach_px = 1;
  double a = 0, b = 0;  // normal equation of the turn
  for (std::size_t i = 0; i < chosen.views.size(); ++i) {
    const auto& points = chosen.views[i].points;
    const auto& residuals = chosen.fit.views[i].residual_px;
    for (std::size_t k = 0; k < points.size(); ++k) {
      std::size_t nearest = k;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < points.size(); ++j) {
        const double distance = (points[j].p_image_px - points[k].p_image_px).norm();
        if (j != k && distance < least) {
          least = distance;
          nearest = j;
        }
      }
      const Eigen::Vector2d from_middle = points[k].p_image_px - middle;
      const Eigen::Vector2d turn =
          from_middle.squaredNorm() * Eigen::Vector2d(-from_middle.y(), from_middle.x());
      together += residuals[k].dot(residuals[nearest]);
      squares += residuals[k].squaredNorm();
      a += turn.squaredNorm();
      b += turn.dot(residuals[k]);
      count += 1;
      reach_px = std::max(reach_px, from_middle.norm());
    }
  }
  pattern.neighbour_correlation = squares > 0 ? together / squares : 0;
  // Two numbers a point; pairs that are each other's neighbour count twice.
  pattern.correlation_limit = 4 * std::sqrt(1.6 / (2 * count));
  const double slope = b / a;
  const double left = std::max(squares - b * slope, 1e-12) / std::max(1.0, 2 * count - 1);
  pattern.s_distortion_px = slope * std::pow(reach_px, 3);
  pattern.s_distortion_in_sigmas = slope / std::sqrt(left / a);
  return pattern;
}

double largest_distortion_px(const Intrinsics& intrinsics, int width, int height) {
  Intrinsics plain = intrinsics;
  plain.distortion = {};
  const Camera without(calibration_of(plain, RigidTransform::Identity()));
  const Camera with(calibration_of(intrinsics, RigidTransform::Identity()));
  double largest = 0;
  constexpr int kSteps = 8;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d at((width - 1.0) * i / kSteps, (height - 1.0) * j / kSteps);
      const auto distorted = with.project(without.ray_camera(at));
      largest = std::max(largest, (distorted->p_image_px - at).norm());
    }
  }
  return largest;
}

double covered_share(const ChosenFit& chosen, int width, int height) {
  std::vector<cv::Point2f> points;
  for (const PointView& view : chosen.views) {
    for (const CameraPoint& point : view.points)
      points.emplace_back(cv::Point2d(point.p_image_px.x(), point.p_image_px.y()));
  }
  if (points.size() < 3) return 0;
  std::vector<cv::Point2f> hull;
  cv::convexHull(points, hull);
  return cv::contourArea(hull) / (static_cast<double>(width) * height);
}

}  // namespace tubed
