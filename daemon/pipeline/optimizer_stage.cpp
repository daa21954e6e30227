#include "daemon/pipeline/optimizer_stage.hpp"

#include <algorithm>

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kSameInstant{2};         // exposures of two views nearer than this are one instant
constexpr milliseconds kSecondViewTimeout{20};  // how long a measured view waits for the other one's Frangi
constexpr std::chrono::seconds kWordsEvery{5};  // of one disagreement
constexpr milliseconds kLateImage{250};         // after a stall an image this old is history, not news

nanoseconds from_ms(double ms) { return nanoseconds{static_cast<std::int64_t>(ms * 1e6)}; }

void stamp_image(const ImageMeasurement& image, TubeEstimate& estimate) {
  estimate.image_frame = image.frame_number;
  estimate.stamps.exposure_ns = to_ns(image.exposure);
  estimate.stamps.image_grabbed_ns = to_ns(image.grabbed);
  estimate.stamps.frangi_started_ns = to_ns(image.frangi_started);
  estimate.stamps.frangi_finished_ns = to_ns(image.frangi_finished);
}

bool same_instant(MonotonicTime a, MonotonicTime b) { return std::chrono::abs(a - b) <= kSameInstant; }

bool has_image(const Observation& observation) {
  return std::ranges::any_of(observation.images, [](const ImageMeasurement* image) {
    return image != nullptr && image->state == ImageState::kMeasured;
  });
}

}  // namespace

OptimizerStage::OptimizerStage(std::vector<std::unique_ptr<Estimator>> estimators,
                               std::vector<TripleBuffer<TubeEstimate>*> outlets,
                               std::vector<CameraInlet> cameras, EmRing& em, const PipelineSettings& settings,
                               Doorbell& own_bell, Doorbell& publisher_bell,
                               const std::optional<ReferenceDescription>& reference)
    : estimators_(std::move(estimators)),
      outlets_(std::move(outlets)),
      cameras_(std::move(cameras)),
      states_(cameras_.size()),
      em_ring_(em),
      bell_(own_bell),
      publisher_bell_(publisher_bell),
      period_(from_ms(1000.0 / settings.rate_hz)),
      schedule_(period_, from_ms(settings.tick_grace_ms)),
      em_(reference),
      max_image_timeout_(from_ms(settings.image_stale_ms)),
      max_em_timeout_(from_ms(settings.em_stale_ms)),
      sequence_numbers_(estimators_.size(), 0) {}

void OptimizerStage::wait(const Clock& clock) noexcept {
  const MonotonicTime now = clock.now();
  // While a second view is awaited there is an unused image: look again soon even if nobody rings.
  const MonotonicTime soon =
      now + (oldest_unused() >= 0 ? nanoseconds(milliseconds(1)) : nanoseconds(milliseconds(100)));
  bell_.wait_until(std::min(soon, std::max(next_estimate(), now)));
}

// By the clock. That the measurements have become stale is said at once, not up to a period later.
MonotonicTime OptimizerStage::next_estimate() const noexcept {
  return std::min(schedule_.next_tick(), em_becomes_stale());
}

// MonotonicTime::max() when that has been said, or there never was a measurement.
MonotonicTime OptimizerStage::em_becomes_stale() const noexcept {
  const EmFrame* const newest = em_.newest_until(MonotonicTime::max());
  if (newest == nullptr || newest->measured <= told_stale_) {
    return MonotonicTime::max();
  }
  return newest->measured + em_.timeout(max_em_timeout_) + nanoseconds(1);
}

// A step that only takes measurements in is none: no estimate is due for them.
bool OptimizerStage::step(const Clock& clock) noexcept {
  const MonotonicTime now = clock.now();
  take_em();
  take_images(now);
  const int camera = oldest_unused();
  if (camera >= 0) {
    if (is_waiting_for_second_view(camera, now)) {
      return false;
    }
    make_estimates(observe(states_[static_cast<std::size_t>(camera)].newest, now, true), clock);
    return true;
  }
  if (now < next_estimate()) {
    return false;
  }
  make_estimates(observe(now, now, false), clock);
  return true;
}

void OptimizerStage::take_em() noexcept {
  while (em_ring_.pop(incoming_)) {
    backward_em_ += em_.add(incoming_) ? 0 : 1;
  }
}

void OptimizerStage::take_images(MonotonicTime now) noexcept {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    CameraState& state = states_[i];
    if (cameras_[i].announcements->fetch()) {
      state.announced = cameras_[i].announcements->front();
    }
    take_view(i);
    if (!cameras_[i].measurements->fetch()) {
      continue;
    }
    const ImageMeasurement& image = cameras_[i].measurements->front();
    if (now - image.exposure > kLateImage) {
      ++late_images_;
      state.unused = false;
      continue;
    }
    state.unused = true;
    image_timeout_.saw_instant(image.exposure);
    state.newest = image.exposure;
    state.state = image.state;
    state.seen_any = true;
    if (image.state == ImageState::kMeasured) {
      (state.is_moved ? state.newest_left_out : state.newest_measured) = image.exposure;
    }
  }
}

// Moving blades and the like leave open what was known before.
void OptimizerStage::take_view(std::size_t camera) noexcept {
  TripleBuffer<ViewVerdict>* const views = cameras_[camera].views;
  if (views != nullptr && views->fetch()) {
    CameraState& state = states_[camera];
    state.view = views->front();
    state.is_moved = state.view.state == ViewState::kSuspect || state.view.state == ViewState::kMoved;
  }
}

int OptimizerStage::oldest_unused() const noexcept {
  int oldest = -1;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i].unused &&
        (oldest < 0 || states_[i].newest < states_[static_cast<std::size_t>(oldest)].newest)) {
      oldest = static_cast<int>(i);
    }
  }
  return oldest;
}

// Another view of the same instant has been grabbed and its Frangi is not done: worth a short wait.
bool OptimizerStage::is_waiting_for_second_view(int camera, MonotonicTime now) const noexcept {
  const MonotonicTime instant = states_[static_cast<std::size_t>(camera)].newest;
  const MonotonicTime measured =
      cameras_[static_cast<std::size_t>(camera)].measurements->front().frangi_finished;
  if (now - measured > kSecondViewTimeout) {
    return false;
  }
  return std::any_of(states_.begin(), states_.end(), [instant](const CameraState& state) {
    return same_instant(state.announced, instant) && !same_instant(state.newest, instant);
  });
}

Observation OptimizerStage::observe(MonotonicTime instant, MonotonicTime now,
                                    bool is_image_instant) noexcept {
  Observation observation;
  observation.instant = instant;
  observation.now = now;
  observation.is_image_instant = is_image_instant;
  observation.em = &em_;
  observation.image_timeout = image_timeout_.timeout(max_image_timeout_);
  MonotonicTime newest{};
  for (std::size_t i = 0; i < states_.size(); ++i) {
    CameraState& state = states_[i];
    observation.geometry_changed = observation.geometry_changed || state.is_moved;
    if (is_image_instant && state.unused && same_instant(state.newest, instant)) {
      state.unused = false;
      show(i, observation);
    }
    observation.newest_image = std::max(observation.newest_image, state.newest_measured);
    observation.newest_left_out = std::max(observation.newest_left_out, state.newest_left_out);
    if (state.seen_any && state.newest >= newest) {
      newest = state.newest;
      observation.fluoroscopy_off = state.state == ImageState::kOff;
      observation.image_rejected = state.state == ImageState::kRejected;
    }
  }
  return observation;
}

void OptimizerStage::show(std::size_t camera, Observation& observation) noexcept {
  ImageMeasurement* const image = &cameras_[camera].measurements->front();
  ImageOnDemand* on_demand = nullptr;
  if (cameras_[camera].prediction != nullptr) {
    if (image->state == ImageState::kMeasured) {
      cameras_[camera].prediction->look_from(image->geometry);
    }
    on_demand = &cameras_[camera].prediction->on_demand();
    on_demand->begin();
  }
  const CameraState& state = states_[camera];
  if (!state.is_moved) {
    observation.images[camera] = image;
    observation.on_demand[camera] = on_demand;
  } else if (image->state == ImageState::kMeasured) {
    observation.moved[camera] = {image,
                                 on_demand,
                                 state.view.moves,
                                 state.view.has_settled,
                                 state.view.is_suspect_here,
                                 state.view.motion};
  }
}

void OptimizerStage::make_estimates(const Observation& observation, const Clock& clock) noexcept {
  asked_ = observation.now;
  bool is_beside = has_image(observation);
  begin_predictions(observation);
  for (std::size_t i = 0; i < estimators_.size(); ++i) {
    TubeEstimate& estimate = outlets_[i]->back();
    estimate.instrument = static_cast<std::uint32_t>(i);
    estimate.sequence_number = ++sequence_numbers_[i];
    estimate.stamps = StageStamps{};
    estimate.image_frame = 0;
    for (const ImageMeasurement* image : observation.images) {
      if (image != nullptr) stamp_image(*image, estimate);
    }
    estimate.stamps.optimizer_started_ns = to_ns(clock.now());
    estimators_[i]->update(observation, estimate);
    for (std::size_t v = 0; v < observation.moved.size(); ++v) {
      const ImageMeasurement* const image = observation.moved[v].image;
      if (image != nullptr && uses(estimate, v, image->exposure)) stamp_image(*image, estimate);
    }
    const MonotonicTime finished = clock.now();
    estimate.stamps.optimizer_finished_ns = to_ns(finished);
    if (overran_ || finished - observation.now > period_) {
      estimate.reasons.add(Reason::kDeadlineMissed);
    }
    newest_validity_ = estimate.validity;
    is_beside = is_beside && estimate.in_view_ratio <= 0 && estimate.validity != Validity::kNotAvailable;
    predict(estimators_[i]->image_need(), estimate);
    superseded_ += outlets_[i]->publish() ? 1 : 0;
    ++outputs_;
    publisher_bell_.ring();
  }
  const MonotonicTime handed_over = clock.now();
  for (const auto& estimator : estimators_) {
    estimator->look_further(observation);
  }
  overran_ = clock.now() - handed_over > period_;
  hand_over_predictions();
  if (has_image(observation)) beside_views_.saw(observation.instant, !is_beside);
  ask_why(observation.now);
  schedule_.paid(observation.now);
  if (observation.now >= em_becomes_stale()) {
    told_stale_ = em_.newest_until(MonotonicTime::max())->measured;
  }
}

void OptimizerStage::begin_predictions(const Observation& observation) noexcept {
  for (const CameraInlet& camera : cameras_) {
    if (camera.prediction != nullptr) {
      camera.prediction->begin(observation.instant, observation.image_timeout);
    }
  }
}

void OptimizerStage::predict(const ImageNeed& need, const TubeEstimate& estimate) noexcept {
  for (const CameraInlet& camera : cameras_) {
    if (camera.prediction != nullptr) {
      camera.prediction->add(need, estimate);
    }
  }
}

void OptimizerStage::hand_over_predictions() noexcept {
  for (std::size_t v = 0; v < cameras_.size(); ++v) {
    const CameraInlet& camera = cameras_[v];
    if (camera.prediction != nullptr) {
      for (const auto& estimator : estimators_) {
        camera.prediction->read_as(estimator->polarity_of(v));
      }
      camera.predictions->back() = camera.prediction->end();
      camera.predictions->publish();
    }
  }
}

// The amounts in the words change a little all the time; who reads them, and the log, wants them seldom.
void OptimizerStage::ask_why(MonotonicTime now) noexcept {
  std::array<char, 256> words{};
  const auto any_says = [this](const auto& says) { return std::ranges::any_of(estimators_, says); };
  const auto keep_for_a_while = [&] {
    if (why_[0] != '\0' && now - why_written_ < kWordsEvery) return;
    why_ = words;
    why_written_ = now;
  };
  if (any_says([&](const auto& estimator) { return estimator->describe_disagreement(words); })) {
    keep_for_a_while();
  } else if (any_says([&](const auto& estimator) { return estimator->describe_moved_view(words); })) {
    why_ = words;
  } else if (any_says([&](const auto& estimator) { return estimator->describe_jump(words); })) {
    keep_for_a_while();
  } else if (beside_views_.describe(words)) {
    keep_for_a_while();
  } else {
    why_[0] = '\0';
  }
}

void OptimizerStage::describe(StageReport& report) const noexcept {
  report.state = outputs_ == 0 || newest_validity_ == Validity::kNotAvailable
                     ? StageState::kStarting
                     : (newest_validity_ == Validity::kValid ? StageState::kRunning : StageState::kDegraded);
  report.outputs = outputs_;
  report.dropped = superseded_ + late_images_;
  report.refused = backward_em_;
  // Where the reference is lost everything else follows from that.
  em_.reference().describe(asked_, report.why);
  if (report.why[0] == '\0') {
    report.why = why_;
  }
}

}  // namespace tubed
