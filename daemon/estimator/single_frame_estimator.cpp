#include "daemon/estimator/single_frame_estimator.hpp"

#include "daemon/estimator/report.hpp"

namespace tubed {

SingleFrameEstimator::SingleFrameEstimator(const EstimatorSettings& settings,
                                           const InstrumentDescription& instrument,
                                           const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      T_world_em_(room.T_world_em),
      registered_(room.registered),
      solver_(settings, instrument),
      views_(settings, instrument, room) {}

void SingleFrameEstimator::reset() noexcept {
  views_.forget();
  lost_tube_.forget();
  has_shape_ = false;
  has_covariance_ = false;
  is_ambiguous_ = false;
}

ImageNeed SingleFrameEstimator::image_need() const noexcept {
  if (settings_.mode == EstimatorMode::kEm || !registered_) {
    return {.kind = ImageNeed::Kind::kNothing};
  }
  return {has_shape_ ? ImageNeed::Kind::kAroundTube : ImageNeed::Kind::kWhole, settings_.image_search_px,
          TubeViews::kBeyondTip_px};
}

void SingleFrameEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  begin_report(observation, estimate);
  ImageVerdict images = ImageVerdict::kNone;
  const EmFrame* frame = observation.em->newest_until(observation.instant);
  CoilObservations coils = observe_coils(frame, *observation.em, instrument_, T_world_em_,
                                         static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
  if (is_stale(frame, observation, settings_)) {
    estimate.reasons.add(Reason::kEmStale);
  } else if (solver_.solve_em(coils, estimate)) {
    if (settings_.mode != EstimatorMode::kEm && registered_) {
      images = solver_.fuse_images(observation, coils, views_, Asked::kOnce, estimate);
      // Between images nobody asks; a coil that holds the tip answers.
      is_ambiguous_ =
          estimate.has_image ? solver_.is_ambiguous() : is_ambiguous_ && solver_.has_loose_tip(coils);
    }
    has_covariance_ = solver_.invert(observation, coils, views_);
    has_shape_ = true;
    // A tick's shape is of its newest measurement; the instant of an image is its exposure.
    shape_time_ = observation.is_image_instant ? observation.instant : frame->measured;
  }
  const LooseEnds loose_ends = find_loose_ends(observation, coils, estimate.has_image);
  const FoundShape shape{.spline = &solver_.map().spline(),
                         .C = has_shape_ ? &solver_.C() : nullptr,
                         .covariance = has_covariance_ ? &solver_.map() : nullptr,
                         .time = shape_time_,
                         .rival = &solver_.rival(),
                         .loose_ends = &loose_ends};
  write_shape(shape, instrument_, estimate);
  add_reference_error(frame, *observation.em, T_world_em_, estimate);
  write_coils(coils, shape, estimate);
  write_held_by_coils(coils, estimate);
  write_held_by_images(observation, views_, estimate);
  write_measurements(frame, views_.newest_exposure(), estimate);
  is_ambiguous_ = is_ambiguous_ && estimate.view_count > 0;
  judge(
      observation, coils,
      {settings_.mode != EstimatorMode::kEm, registered_, solver_.converged(),
       lost_tube_.standing(observation, images, &views_), false, is_ambiguous_, loose_ends.lost(shape_time_)},
      estimate);
}

// Of coils and images of this instant alone, as the shape is.
LooseEnds SingleFrameEstimator::find_loose_ends(const Observation& observation, const CoilObservations& coils,
                                                bool has_image) {
  LooseEnds ends;
  ends.observe(coils, shape_time_);
  if (has_image) ends.observe(views_.constraints(observation, 1, true), shape_time_);
  return ends;
}

}  // namespace tubed
