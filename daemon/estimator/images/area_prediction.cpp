#include "daemon/estimator/images/area_prediction.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kTubeSpeed_mm_s = 30;  // across itself or at its tip, with what the breathing adds
constexpr double kSigmas = 3;
constexpr double kMaxSpread_px = 48;     // of kSigmas: a place worse known than this is none
constexpr double kBetweenPixels_px = 1;  // places between pixels are read from both

}  // namespace

AreaPrediction::AreaPrediction(const CameraCalibration& camera, const FrangiSettings& settings)
    : camera_(camera), on_demand_(camera.width, camera.height, settings) {
  predicted_.area = ImageArea(camera.width, camera.height);
}

void AreaPrediction::begin(MonotonicTime instant, std::chrono::nanoseconds timeout) {
  predicted_.area.clear();
  predicted_.until = instant + timeout;
  predicted_.polarity.reset();
  motion_mm_ = kTubeSpeed_mm_s * std::chrono::duration<double>(timeout).count();
}

AreaPrediction::Place AreaPrediction::place_of(const CentrelinePoint& point, double reach_px) const {
  const auto projection = camera_.project(Eigen::Map<const Eigen::Vector3d>(point.p_world_mm.data()));
  if (!projection) {
    return {};
  }
  const std::array<float, 6>& upper = point.covariance_mm2;
  Eigen::Matrix3f covariance_mm2;
  covariance_mm2 << upper[0], upper[1], upper[2], upper[1], upper[3], upper[4], upper[2], upper[4], upper[5];
  // The trace is no less than the variance in any direction of the image.
  const double variance_px2 =
      (projection->J_image_world * covariance_mm2.cast<double>() * projection->J_image_world.transpose())
          .trace();
  const double spread_px = kSigmas * std::sqrt(variance_px2);
  const double motion_px = motion_mm_ * camera_.calibration().fx / projection->depth_mm;
  return {projection->p_image_px, reach_px + kBetweenPixels_px + spread_px + motion_px,
          spread_px <= kMaxSpread_px};
}

const PredictedArea& AreaPrediction::end() {
  predicted_.area.add(on_demand_.asked());
  return predicted_;
}

void AreaPrediction::add(const ImageNeed& need, const TubeEstimate& estimate) {
  if (need.kind == ImageNeed::Kind::kNothing) {
    return;
  }
  if (need.kind == ImageNeed::Kind::kWhole || estimate.point_count < 2) {
    predicted_.area.add_whole();
    return;
  }
  Place before = place_of(estimate.points[0], need.reach_px + need.beyond_tip_px);
  for (std::uint32_t i = 1; i < estimate.point_count; ++i) {
    const Place here = place_of(estimate.points[i], need.reach_px);
    if (before.known && here.known) {
      const Eigen::Vector2d reach = Eigen::Vector2d::Constant(std::max(before.reach_px, here.reach_px));
      predicted_.area.add_box(before.p_px.cwiseMin(here.p_px) - reach,
                              before.p_px.cwiseMax(here.p_px) + reach);
    }
    before = here;
  }
}

}  // namespace tubed
