// Where the next image of a camera will be read: around every instrument's tube.
#pragma once

#include "daemon/estimator/estimator.hpp"
#include "daemon/image/vesselness_meter.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Where an image should be measured before anybody reads it.
struct PredictedArea {
  ImageArea area;
  /// Exposures later than this are not foreseen: the whole image. Zero: none is.
  MonotonicTime until{};
  std::optional<RidgePolarity> polarity;  ///< that the next image is to be read for; nothing: as before
};

/// What the optimizer thread does with the images of one camera besides estimating: lets the estimators have
/// measured what they read, and predicts what they will read next. Memory is taken in the constructor.
class AreaPrediction {
 public:
  /// Throws as FrangiFilter.
  AreaPrediction(const CameraCalibration& camera, const FrangiSettings& settings);

  /// What to give the estimators with the image they are asked about; lives as long as this.
  ImageOnDemand& on_demand() { return on_demand_; }

  /// The view stood so when its newest image was taken: the next one is expected to be taken from there.
  void look_from(const std::optional<ViewGeometry>& geometry) { camera_.look_from(geometry); }

  /// Begins the prediction for images until `instant` + `timeout`.
  void begin(MonotonicTime instant, std::chrono::nanoseconds timeout);

  /// Adds where the tube of `estimate` will be read by the estimator that made it.
  void add(const ImageNeed& need, const TubeEstimate& estimate);

  /// Adds what that estimator has found of the images' polarity, if anything.
  void read_as(std::optional<RidgePolarity> polarity) {
    if (polarity) predicted_.polarity = polarity;
  }

  /// Ends it: with what was asked of the last image, too, as the shape of an instant alone is looked for in
  /// places that no estimate foretells. Lives until the next begin().
  const PredictedArea& end();

 private:
  /// A point of the centreline in the image, and how far around it is read.
  struct Place {
    Eigen::Vector2d p_px = Eigen::Vector2d::Zero();
    double reach_px = 0;
    bool known = false;  ///< in front of the camera, with a covariance worth its name
  };

  [[nodiscard]] Place place_of(const CentrelinePoint& point, double reach_px) const;

  Camera camera_;
  ImageOnDemand on_demand_;
  PredictedArea predicted_;
  double motion_mm_ = 0;  ///< how far a tube may go until the images foreseen
};

}  // namespace tubed
