#include "daemon/estimator/recursive_estimator.hpp"

#include <algorithm>

#include "daemon/estimator/agreement/agreement_words.hpp"
#include "daemon/estimator/report.hpp"
#include "daemon/estimator/strain_slack.hpp"
#include "daemon/estimator/tip/loose_tip.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMaxEmFrames = 16;  // a longer gap is bridged by the newest ones
constexpr double kBendingWithoutImages_s = 0.2;

}  // namespace

RecursiveEstimator::RecursiveEstimator(const EstimatorSettings& settings,
                                       const InstrumentDescription& instrument, const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      room_(room),
      beginning_(settings, instrument),
      motion_(beginning_.map(), instrument_),
      em_update_(settings, beginning_.map(), static_cast<int>(instrument.coils.size())),
      image_update_(settings, instrument, room, beginning_.map().columns().count()),
      judge_(settings, instrument, room, beginning_.solver()),
      learnt_bending_(beginning_.map().bending_node_count(), beginning_.map().spline().spacing_mm()),
      state_(beginning_.map(), settings, static_cast<int>(instrument.coils.size())),
      before_update_(state_),
      past_(state_),
      shape_{state_.tube.C},
      agreement_(room_errors(room, instrument), instrument, static_cast<int>(room.cameras.size())) {}

void RecursiveEstimator::reset() noexcept {
  image_update_.views().forget();
  lost_tube_.forget();
  agreement_.reset();
  state_.errors.reset();
  state_.gate.reset();
  state_.loose_ends = {};
  state_.freedom.forget_surprises();
  state_.images.confirmed = MonotonicTime{};
  state_.images.is_ambiguous = false;
  state_.begun = false;
  state_.newest_em = MonotonicTime{};
  past_.forget();
  shape_.covariance = nullptr;
}

void RecursiveEstimator::set_rest(RestHook* hook) noexcept {
  beginning_.set_rest(hook);
  image_update_.set_rest(hook);
}

// An estimate that images or coils speak against may have to be begun again somewhere else.
ImageNeed RecursiveEstimator::image_need() const noexcept {
  const bool trusted = state_.begun && state_.images.without_tube == 0 && !state_.doubt.any() &&
                       shape_.images != ImageVerdict::kLost;
  return {trusted ? ImageNeed::Kind::kAroundTube : ImageNeed::Kind::kWhole, ImageUpdate::kFirstReach_px,
          TubeViews::kBeyondTip_px};
}

bool RecursiveEstimator::describe_disagreement(std::span<char> words) const noexcept {
  if (agreement_.disagree() && agreement_.verdict().explanation != Discord::kNone) {
    write_disagreement(agreement_.summary(), instrument_, room_.cameras, words);
    return true;
  }
  if (image_update_.views().marks_are_missing()) {
    write_missing_marks(instrument_, words);
    return true;
  }
  return false;
}

bool RecursiveEstimator::describe_jump(std::span<char> words) const noexcept {
  const double jump_mm = state_.common_jump.left_mm(shape_.time);
  if (jump_mm < CommonJump::kJump_mm) return false;
  write_common_jump(instrument_, jump_mm, words);
  return true;
}

CoilObservations RecursiveEstimator::observe(const EmFrame* frame, const EmHistory& history) const {
  CoilObservations coils = observe_coils(frame, history, instrument_, room_.T_world_em,
                                         static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
  state_.gate.write_beliefs(coils);
  return coils;
}

void RecursiveEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  begin_report(observation, estimate);
  shape_.images = ImageVerdict::kNone;
  const EmFrame* frame = observation.em->newest_until(observation.instant);
  CoilObservations coils = observe(frame, *observation.em);
  if (is_stale(frame, observation, settings_)) {
    estimate.reasons.add(Reason::kEmStale);
  } else {
    if (observation.is_image_instant && observation.instant < state_.tube.time) {
      past_.go_back(observation.instant, state_);
    }
    shape_.images = advance(observation, *frame, coils, estimate);
    // The shape between images is as doubtful as the image left it.
    if (observation.is_image_instant) {
      state_.images.contradicted = shape_.images == ImageVerdict::kContradicts;
    } else if (state_.images.contradicted && shape_.images == ImageVerdict::kNone) {
      shape_.images = ImageVerdict::kContradicts;
    }
    if (state_.begun) {
      shape_.time = observation.is_image_instant ? observation.instant : state_.tube.time;
    }
  }
  const FoundShape shape{&beginning_.map().spline(),
                         state_.begun ? &shape_.C : nullptr,
                         shape_.covariance,
                         shape_.time,
                         state_.freedom.variance_factor(),
                         &state_.images.rival,
                         room_.registered ? &agreement_ : nullptr,
                         &state_.gate.end_jumps(),
                         &state_.common_jump,
                         &state_.loose_ends};
  write_shape(shape, instrument_, estimate);
  add_reference_error(frame, *observation.em, room_.T_world_em, estimate);
  write_coils(coils, shape, estimate);
  write_held_by_coils(coils, estimate);
  write_held_by_images(observation, image_update_.views(), estimate);
  write_measurements(frame, image_update_.views().newest_exposure(), estimate);
  const ImageVerdict standing = lost_tube_.standing(observation, shape_.images, &image_update_.views());
  judge(observation, coils,
        {!room_.cameras.empty(), room_.registered, shape_.converged, standing, agreement_.disagree(),
         state_.images.is_ambiguous, state_.loose_ends.lost(shape_.time)},
        estimate);
}

// The verdict of the images of this instant.
ImageVerdict RecursiveEstimator::advance(const Observation& observation, const EmFrame& newest,
                                         CoilObservations& coils, TubeEstimate& estimate) {
  const EmHistory& history = *observation.em;
  if (state_.begun && newest.measured - state_.newest_em > std::chrono::seconds(1)) {
    state_.begun = false;
    state_.gate.forget_contradictions();  // that was long ago
  }
  take_measurements(newest, history, estimate);
  // Of this state, whenever its newest measurement was taken.
  coils = observe(&newest, history);
  if (state_.begun) state_.gate.leave_out_gated(coils);
  ImageVerdict verdict = ImageVerdict::kNone;
  const bool too_sure = state_.begun && began_too_sure();
  if (state_.begun && !too_sure && !state_.is_lost()) {
    if (room_.registered && observation.is_image_instant) {
      motion_.predict(observation.instant, state_.freedom.learnt(), state_);
      verdict = update_image(observation, coils, estimate);
    } else {
      // A tick asks for a shape and leaves no trace: with or without it the next image finds the same state.
      shape_.C = state_.tube.C;
      if (settle(shape_.C, estimate)) shape_.covariance = image_update_.with_covariance({});
    }
  }
  if (!state_.begun || too_sure || state_.is_lost()) {
    coils = observe(&newest, history);
    state_.gate.leave_out_erratic(coils);
    initialise(observation, coils, newest, verdict, estimate);
  }
  return verdict;
}

// Every one that has come since the newest that was taken, in the order of time.
void RecursiveEstimator::take_measurements(const EmFrame& newest, const EmHistory& history,
                                           TubeEstimate& estimate) {
  std::size_t waiting = 0;
  for (const EmFrame* frame = &newest;
       frame != nullptr && frame->measured > state_.newest_em && waiting < kMaxEmFrames;
       frame = history.before(&newest, waiting)) {
    ++waiting;
  }
  while (waiting > 0) {
    const EmFrame* frame = history.before(&newest, --waiting);
    state_.errors.noise().observe(*frame, history, instrument_);
    const double interval_s = seconds_between(state_.newest_em, frame->measured);
    state_.newest_em = frame->measured;
    if (state_.begun) {
      update_coils(*frame, history, interval_s, estimate);
    }
  }
}

bool RecursiveEstimator::began_too_sure() {
  const LastingCoilErrors::Learnt learnt = state_.errors.learn();
  if (learnt == LastingCoilErrors::Learnt::kAllIsNoise) {
    state_.freedom.forget_surprises();
  }
  return learnt == LastingCoilErrors::Learnt::kPartStays;
}

// A measurement further off the prediction than measurements usually are says that the tube has moved
// otherwise: it is predicted once more, with the freedom that such a jerk needs.
void RecursiveEstimator::update_coils(const EmFrame& frame, const EmHistory& history, double interval_s,
                                      TubeEstimate& estimate) {
  CoilObservations coils = observe(&frame, history);
  notice_common_jump(frame, coils, history);
  before_update_ = state_;
  motion_.predict(frame.measured, state_.freedom.learnt(), state_);
  const double freedom =
      state_.freedom.needed_for(em_update_.gate(frame.measured, interval_s, state_, coils));
  const bool was_jerk = freedom > state_.freedom.learnt();
  if (was_jerk) {
    const MotionFreedom with_this_surprise = state_.freedom;
    state_ = before_update_;
    state_.freedom = with_this_surprise;
    coils = observe(&frame, history);
    motion_.predict(frame.measured, freedom, state_);
    em_update_.gate(frame.measured, interval_s, state_, coils);
  }
  state_.freedom.remember_used(freedom);
  state_.begun = em_update_.take(coils, state_);
  state_.loose_ends.observe(coils, frame.measured);
  // Expected of a freer motion than usual it says nothing against the usual one.
  const CoilUpdate::Pull& pull = em_update_.pull();
  state_.freedom.adapt(was_jerk ? std::max(pull.chi_squared, pull.expected) : pull.chi_squared, pull.expected,
                       interval_s, state_.errors.share());
  if (loose_tip_mm(coils, image_update_.rest()) == 0) {
    state_.images.forget_rival();
  }
  motion_.learn_drift(interval_s, state_);
  ask_alone(frame, history, interval_s);
  learn_bending_from_coils(estimate);
  past_.remember(state_);
}

void RecursiveEstimator::notice_common_jump(const EmFrame& frame, const CoilObservations& coils,
                                            const EmHistory& history) {
  const EmFrame* const before = history.before(&frame, 1);
  if (before == nullptr) return;
  const bool jumped = state_.common_jump.observe(observe(before, history), coils,
                                                 seconds_between(before->measured, frame.measured),
                                                 state_.errors.noise().noise_position_mm(), frame.measured);
  if (jumped) agreement_.forget_held();
}

// What is wrong, a coil or the shape? The coils of a measurement alone, led by nothing older, may name a
// coil.
void RecursiveEstimator::ask_alone(const EmFrame& frame, const EmHistory& history, double interval_s) {
  if (state_.gate.asks_alone(frame.measured, interval_s)) {
    CoilObservations alone = observe(&frame, history);
    const bool known = judge_.solve_em(alone);
    state_.gate.take_answer(known, alone, frame.measured, state_.images.confirm_at(frame.measured));
  }
}

ImageVerdict RecursiveEstimator::update_image(const Observation& observation, const CoilObservations& coils,
                                              TubeEstimate& estimate) {
  ImageUpdate::Outcome outcome =
      image_update_.apply(observation, coils, ImageUpdate::Jerk::kAsked, state_, estimate);
  if (outcome.is_jerk) {
    before_update_.tube.P = state_.tube.P;
    motion_.loosen(outcome.surprise, image_update_.views().layout(), state_);
    outcome = image_update_.apply(observation, coils, ImageUpdate::Jerk::kAllowedFor, state_, estimate);
    if (outcome.verdict != ImageVerdict::kShowsTube) state_.tube.P = before_update_.tube.P;
  }
  if (outcome.numerically_lost) {
    state_.begun = false;
  } else {
    shape_.converged = true;
    shape_.covariance = image_update_.with_covariance(outcome.lines);
    if (!outcome.lines.empty()) learn_from(outcome, observation, coils);
  }
  shape_.C = state_.tube.C;
  ImageVerdict verdict = outcome.verdict;
  if (verdict == ImageVerdict::kShowsTube) {
    const auto agreeing = estimate.image_inlier_ratio;
    verdict = judge_.judge(observation,
                           {state_.tube.C, beginning_.map(), image_update_.views(), agreeing, coils,
                            state_.gate, state_.newest_em, state_.loose_ends.lost(observation.instant).tail},
                           state_.doubt);
  } else {
    state_.doubt.clear();
  }
  state_.images.contradicted = verdict == ImageVerdict::kContradicts;
  if (state_.images.contradicted || verdict == ImageVerdict::kShowsTube) {
    past_.remember(state_);
  }
  return verdict;
}

// Of an image that shows the tube where it was expected.
void RecursiveEstimator::learn_from(const ImageUpdate::Outcome& outcome, const Observation& observation,
                                    const CoilObservations& coils) {
  const Eigen::Matrix3Xd& C = state_.tube.C;
  learn_bending(C);
  state_.freedom.adapt(outcome.pulled, outcome.expected, outcome.interval_s, state_.errors.share());
  motion_.learn_drift(outcome.interval_s, state_);
  const CoilNoise& noise = state_.errors.noise();
  state_.errors.scale().observe(coils, noise, outcome.lines, beginning_.map().spline(), C,
                                outcome.interval_s);
  state_.loose_ends.observe(outcome.lines, observation.instant);
  agreement_.observe(
      coils,
      {observation.instant, beginning_.map().spline(), C, outcome.lines, StateMotion::speed_mm_s(state_)},
      noise.noise_position_mm(), noise.lasting_position_mm(settings_.sigma_position_mm));
}

bool RecursiveEstimator::settle(Eigen::Matrix3Xd& C, TubeEstimate& estimate) {
  if (!image_update_.settle(state_, C, estimate)) {
    state_.begun = false;  // numerically lost: begin again
    return false;
  }
  shape_.converged = true;
  return true;
}

// Of the shape C whose covariance is known.
void RecursiveEstimator::learn_bending(const Eigen::Matrix3Xd& C) {
  if (shape_.covariance != &image_update_.map()) {
    return;
  }
  const MonotonicTime time = state_.tube.time;
  learnt_bending_.learn(image_update_.map(), C, seconds_between(state_.bending_learnt, time), state_.bending);
  state_.bending_learnt = time;
}

// Where images do not do so. It takes a shape, which between images nothing has asked for yet.
void RecursiveEstimator::learn_bending_from_coils(TubeEstimate& estimate) {
  if (!state_.begun || seconds_between(state_.bending_learnt, state_.tube.time) < kBendingWithoutImages_s) {
    return;
  }
  shape_.C = state_.tube.C;
  if (settle(shape_.C, estimate)) {
    shape_.covariance = image_update_.with_covariance({});
    learn_bending(shape_.C);
  }
}

// At a shape of one instant.
bool RecursiveEstimator::initialise(const Observation& observation, CoilObservations& coils,
                                    const EmFrame& frame, ImageVerdict& verdict, TubeEstimate& estimate) {
  state_.forget_doubts();
  state_.begun = false;
  if (!beginning_.solver().solve_em(coils, estimate)) {
    return false;
  }
  TubeViews& views = image_update_.views();
  views.forget();  // lines of older images may be what led the shape away
  if (room_.registered) {
    verdict = beginning_.solver().fuse_images(observation, coils, views, Asked::kToBegin, estimate);
    state_.images.with_tube = verdict == ImageVerdict::kShowsTube ? ImageUpdate::kConfirming : 0;
  }
  beginning_.suppose_coil_errors(state_);
  const auto lines = views.constraints(observation, 1, false);
  const ShapeBeginning::Begun begun = beginning_.begin_with(coils, lines, motion_, state_);
  estimate.iterations += static_cast<std::uint32_t>(begun.iterations);
  shape_.converged = begun.converged;
  if (!begun.is_possible) {
    return false;
  }
  state_.tube.time = observation.is_image_instant ? observation.instant : frame.measured;
  state_.newest_em = frame.measured;
  state_.begun = true;
  state_.bending_learnt = state_.tube.time;
  state_.gate.begin(coils, frame.measured, state_.tube.time);
  state_.loose_ends.observe(coils, frame.measured);
  state_.loose_ends.forget_images();
  state_.loose_ends.observe(lines, observation.instant);
  state_.errors.place(instrument_, beginning_.map().spline(), state_.tube.C);
  shape_.covariance = beginning_.covariance_of(state_.tube.C, coils, lines);
  shape_.C = state_.tube.C;
  past_.remember(state_);
  return true;
}

}  // namespace tubed
