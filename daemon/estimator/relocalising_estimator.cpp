#include "daemon/estimator/relocalising_estimator.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <optional>

#include "daemon/estimator/report.hpp"

namespace tubed {

namespace {

/// An image with another geometry for as long as this lives: other instruments' estimators have their own.
class LentGeometry {
 public:
  void lend(ImageMeasurement& image, const ViewGeometry& geometry) {
    image_ = &image;
    geometry_ = image.geometry;
    brought_ = image.brought_geometry;
    image.geometry = geometry;
    image.brought_geometry = true;
  }
  [[nodiscard]] bool is_lent() const { return image_ != nullptr; }
  void take_back() {
    if (image_ == nullptr) return;
    image_->geometry = geometry_;
    image_->brought_geometry = brought_;
  }

 private:
  ImageMeasurement* image_ = nullptr;
  std::optional<ViewGeometry> geometry_;
  bool brought_ = false;
};

}  // namespace

RelocalisingEstimator::RelocalisingEstimator(const EstimatorSettings& settings,
                                             const InstrumentDescription& instrument,
                                             const RoomDescription& room, std::unique_ptr<Estimator> inside)
    : inside_(std::move(inside)), cameras_(room.cameras) {
  for (const CameraCalibration& camera : room.cameras) {
    views_.push_back(std::make_unique<ViewRelocaliser>(settings, instrument, camera));
  }
}

void RelocalisingEstimator::reset() noexcept {
  inside_->reset();
  for (const auto& view : views_) view->forget();
}

void RelocalisingEstimator::estimate(const Observation& observation, TubeEstimate& estimate) noexcept {
  Observation shown = observation;
  std::array<LentGeometry, kMaxCameras> lent;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const MovedImage& moved = observation.moved[v];
    if (observation.images[v] != nullptr && observation.images[v]->state == ImageState::kMeasured) {
      views_[v]->forget();
    } else if (moved.image != nullptr && views_[v]->holds(moved)) {
      lent[v].lend(*moved.image, views_[v]->pose().geometry());
      shown.images[v] = moved.image;
      shown.on_demand[v] = moved.on_demand;
      shown.newest_image = std::max(shown.newest_image, moved.image->exposure);
    }
  }
  inside_->estimate(shown, estimate);
  for (std::size_t v = 0; v < views_.size(); ++v) {
    lent[v].take_back();
    const MovedImage& moved = observation.moved[v];
    if (lent[v].is_lent()) {
      views_[v]->judge_use(estimate, observation.instant);
    } else if (moved.image != nullptr) {
      views_[v]->observe(moved, estimate);
    }
  }
  add_pose_errors(estimate);
}

bool RelocalisingEstimator::describe_moved_view(std::span<char> words) const noexcept {
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const ViewRelocaliser& view = *views_[v];
    const char* const name = cameras_[v].name.c_str();
    if (view.state() == ViewRelocaliser::State::kLost) {
      std::snprintf(
          words.data(), words.size(),
          "camera %s is lost: it moved, and where to is being found from coils and images; keep the "
          "catheter in view, moving",
          name);
      return true;
    }
    if (view.state() == ViewRelocaliser::State::kFound) {
      std::snprintf(words.data(), words.size(),
                    "camera %s moved and was found from coils and images, to %.1f mm across the view: "
                    "`tubectl calibrate view` writes its pose",
                    name, view.sigma_across_mm());
      return true;
    }
  }
  return false;
}

void RelocalisingEstimator::add_pose_errors(TubeEstimate& estimate) const {
  for (std::size_t i = 0; i < estimate.view_count; ++i) {
    const ViewRelocaliser& view = *views_[estimate.views[i].camera];
    if (view.state() != ViewRelocaliser::State::kFound) continue;
    for (std::size_t k = 0; k < estimate.point_count; ++k) {
      CentrelinePoint& point = estimate.points[k];
      if ((point.held_by & kHeldByImage) == 0) continue;
      const std::array<float, 6> added = upper_triangle(
          view.pose().covariance_across(Eigen::Map<const Eigen::Vector3d>(point.p_world_mm.data())));
      std::transform(added.begin(), added.end(), point.covariance_mm2.begin(), point.covariance_mm2.begin(),
                     std::plus<>());
    }
  }
}

}  // namespace tubed
