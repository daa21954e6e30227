#include "daemon/estimator/view/relocalising_estimator.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <optional>
#include <utility>

#include "daemon/estimator/report.hpp"
#include "daemon/estimator/tip/preshaped_estimator.hpp"

namespace tubed {

namespace {

/// What an image had before it was lent another geometry: other instruments' estimators have their own.
struct OwnGeometry {
  ImageMeasurement* image = nullptr;
  std::optional<ViewGeometry> geometry{};
  bool brought = false;

  void give_back() const {
    if (image == nullptr) return;
    image->geometry = geometry;
    image->brought_geometry = brought;
  }
};

/// Coils alone look at no image, and what would be kept of images takes memory.
RoomDescription without_cameras(RoomDescription room) {
  room.cameras.clear();
  return room;
}

EstimatorSettings with_mode(EstimatorSettings settings, EstimatorMode mode) {
  settings.mode = mode;
  return settings;
}

}  // namespace

RelocalisingEstimator::RelocalisingEstimator(const EstimatorSettings& settings,
                                             const InstrumentDescription& instrument,
                                             const RoomDescription& room, std::unique_ptr<Estimator> inside)
    : inside_(std::move(inside)),
      coils_(with_mode(settings, EstimatorMode::kEm), instrument, without_cameras(room)),
      by_coils_(std::make_unique<TubeEstimate>()),
      tips_are_straight_(
          instrument.rest_shape == RestShape::kStraight ||
          PreshapedEstimator::settings_for_hooks(settings, instrument.length_mm).coefficient_count !=
              settings.coefficient_count),
      cameras_(room.cameras) {
  for (std::size_t v = 0; v < room.cameras.size(); ++v) {
    views_.push_back(std::make_unique<ViewRelocaliser>(settings, instrument, room, v));
  }
}

void RelocalisingEstimator::reset() noexcept {
  inside_->reset();
  coils_.reset();
  for (const auto& view : views_) view->reset();
  lent_ = {};
}

// Not while no pose was found, nor where the view may have moved on.
void RelocalisingEstimator::lend(std::size_t view, const MovedImage& moved) {
  if (!views_[view]->holds(moved) || moved.is_suspect_here) return;
  lent_[view] = {views_[view]->pose(), moved.image->exposure};
}

bool RelocalisingEstimator::is_lent(std::size_t view, const MovedImage& moved) const {
  return moved.image != nullptr && lent_[view].exposure == moved.image->exposure;
}

// Calls `show` with the observation and the images that are lent, with the pose that they were lent with.
template <typename Show>
void RelocalisingEstimator::show_lent(const Observation& observation, const Show& show) {
  Observation shown = observation;
  std::array<OwnGeometry, kMaxCameras> own;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const MovedImage& moved = observation.moved[v];
    if (!is_lent(v, moved)) continue;
    own[v] = {moved.image, moved.image->geometry, moved.image->brought_geometry};
    moved.image->geometry = lent_[v].pose.geometry();
    moved.image->brought_geometry = true;
    shown.images[v] = moved.image;
    shown.on_demand[v] = moved.on_demand;
    shown.newest_image = std::max(shown.newest_image, moved.image->exposure);
  }
  show(shown);
  for (const OwnGeometry& before : own) before.give_back();
}

void RelocalisingEstimator::look_further(const Observation& observation) noexcept {
  show_lent(observation, [this](const Observation& shown) { inside_->look_further(shown); });
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const MovedImage& moved = observation.moved[v];
    if (moved.image != nullptr && !moved.is_suspect_here) views_[v]->look_further(moved);
  }
}

void RelocalisingEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const ImageMeasurement* const image = observation.images[v];
    const MovedImage& moved = observation.moved[v];
    if (image != nullptr && image->state == ImageState::kMeasured) {
      views_[v]->note_image(image->exposure);
      views_[v]->forget();
    } else if (moved.image != nullptr) {
      views_[v]->note_image(moved.image->exposure);
      lend(v, moved);
    }
  }
  show_lent(observation, [&](const Observation& shown) { inside_->update(shown, estimate); });
  add_pose_errors(estimate);
  doubt(estimate);
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const MovedImage& moved = observation.moved[v];
    if (is_lent(v, moved)) {
      views_[v]->judge_use(*moved.image, estimate);
      refine(v, observation, estimate);
    } else if (moved.image != nullptr && !moved.is_suspect_here) {
      views_[v]->observe(moved, estimate);
    }
  }
}

// Not where a hook may be in use, since coils alone take every tip for straight, nor where coils alone
// believe others than the estimate does.
void RelocalisingEstimator::refine(std::size_t view, const Observation& observation,
                                   const TubeEstimate& estimate) {
  const MonotonicTime exposure = observation.moved[view].image->exposure;
  if (!tips_are_straight_ || !uses(estimate, view, exposure) ||
      estimate.reasons.has(Reason::kImageLostTube)) {
    return;
  }
  Observation without_images = observation;
  without_images.images = {};
  coils_.estimate(without_images, *by_coils_);
  const auto left_out = [](const TubeEstimate& of) { return of.reasons.has(Reason::kCoilOutlier); };
  if (by_coils_->coefficient_count == estimate.coefficient_count &&
      left_out(*by_coils_) == left_out(estimate)) {
    views_[view]->refine(observation.moved[view], estimate, *by_coils_);
  }
}

// Also while fluoroscopy is off: what images of a found view taught of the coils is as good as its pose.
void RelocalisingEstimator::doubt(TubeEstimate& estimate) const {
  const bool is_found = std::ranges::any_of(
      views_, [](const auto& view) { return view->state() == ViewRelocaliser::State::kFound; });
  if (!is_found) return;
  estimate.reasons.add(Reason::kGeometryChanged);
  if (estimate.validity == Validity::kValid) estimate.validity = Validity::kQuestionable;
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
    const ViewUsed& used = estimate.views[i];
    const Lent& lent = lent_[used.camera];
    if (lent.exposure == MonotonicTime{} || used.exposure_monotonic_ns != to_ns(lent.exposure)) continue;
    for (std::size_t k = 0; k < estimate.point_count; ++k) {
      CentrelinePoint& point = estimate.points[k];
      if ((point.held_by & kHeldByImage) == 0) continue;
      const std::array<float, 6> added = upper_triangle(
          lent.pose.covariance_across(Eigen::Map<const Eigen::Vector3d>(point.p_world_mm.data())));
      std::transform(added.begin(), added.end(), point.covariance_mm2.begin(), point.covariance_mm2.begin(),
                     std::plus<>());
    }
  }
}

}  // namespace tubed
