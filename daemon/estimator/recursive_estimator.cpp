#include "daemon/estimator/recursive_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimator/agreement_words.hpp"
#include "daemon/estimator/loose_tip.hpp"
#include "daemon/estimator/report.hpp"

namespace tubed {

namespace {

constexpr double kNegligibleShare = 0.25;  // of the variance of coils' errors, that stays
constexpr int kUpdateIterations = 3;
constexpr std::size_t kMaxEmFrames = 16;  // a longer gap is bridged by the newest ones

}  // namespace

RecursiveEstimator::State::State(int column_count, Eigen::Index bending_node_count,
                                 const EstimatorSettings& settings)
    : C(Eigen::Matrix3Xd::Zero(3, column_count)),
      m(C),
      P(Eigen::MatrixXd::Identity(C.size(), C.size())),
      noise(settings),
      error_scale(settings),
      beliefs(beliefs_at_first(settings.coil_faults)),
      bending(Eigen::VectorXd::Ones(bending_node_count)),
      rival(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)) {}

RecursiveEstimator::RecursiveEstimator(const EstimatorSettings& settings,
                                       const InstrumentDescription& instrument, const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      T_world_em_(room.T_world_em),
      registered_(room.registered),
      has_cameras_(!room.cameras.empty()),
      cameras_(room.cameras),
      start_(settings, instrument.length_mm),
      map_(settings, instrument.length_mm, static_cast<int>(instrument.coils.size()),
           TubeMotion::column_count_of_motion(instrument.length_mm)),
      image_map_(settings, instrument.length_mm),
      views_(settings, instrument, room),
      second_look_(settings, instrument, room),
      second_opinion_(std::make_unique<TubeEstimate>()),
      motion_(map_.spline(), map_.column_count()),
      learnt_bending_(map_.bending_node_count(), map_.spline().spacing_mm()),
      mirror_test_(settings.coefficient_count),
      coil_update_(static_cast<int>(instrument.coils.size()), map_.column_count()),
      coil_faults_(settings.coil_faults, static_cast<int>(instrument.coils.size())),
      innovations_(static_cast<int>(instrument.coils.size())),
      state_(map_.column_count(), map_.bending_node_count(), settings),
      before_update_(state_),
      past_{state_, state_, state_, state_, state_, state_, state_, state_},
      prior_{state_.P, state_.C},
      coefficients_(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)),
      coefficient_prior_{Eigen::MatrixXd::Zero(coefficients_.size(), coefficients_.size()), coefficients_},
      coefficient_cholesky_(coefficients_.size()),
      following_(Eigen::MatrixXd::Zero(state_.P.rows() - coefficients_.size(), coefficients_.size())),
      following_covariance_(following_),
      C_before_(state_.C),
      shape_(state_.C),
      scratch_(state_.P),
      departure_(Eigen::VectorXd::Zero(coefficients_.size())),
      information_times_departure_(departure_),
      agreement_(room_errors(room, instrument), instrument, static_cast<int>(room.cameras.size())) {
  image_map_.set_strain_slack(kStrainSlack);
}

void RecursiveEstimator::reset() noexcept {
  views_.forget();
  lost_tube_.forget();
  agreement_.reset();
  state_.noise.reset();
  state_.error_scale.reset();
  state_.doubted = {};
  state_.beliefs = beliefs_at_first(settings_.coil_faults);
  state_.confirmed = MonotonicTime{};
  state_.usual = UsualSurprise{};
  state_.is_ambiguous = false;
  state_.begun = false;
  state_.newest_em = MonotonicTime{};
  for (State& past : past_) {
    past.begun = false;
  }
  covariance_ = nullptr;
}

void RecursiveEstimator::set_rest(RestHook* hook) noexcept {
  rest_ = hook;
  start_.set_rest(hook);
  map_.set_rest(hook);
  image_map_.set_rest(hook);
}

bool RecursiveEstimator::describe_disagreement(std::span<char> words) const noexcept {
  if (!agreement_.disagree() || agreement_.verdict().explanation == Discord::kNone) {
    return false;
  }
  write_disagreement(agreement_.verdict(), instrument_, cameras_, words);
  return true;
}

CoilObservations RecursiveEstimator::observe(const EmFrame* frame, const EmHistory& history) const {
  CoilObservations coils = observe_coils(frame, history, instrument_, T_world_em_,
                                         static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
  const bool snapped = most_are_out();  // then the shape is what is wrong
  for (int i = 0; i < coils.count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const DoubtedCoil& doubted = state_.doubted[index];
    const bool is_doubtful = doubted.alone_as_well || (doubted.is_out && !snapped);
    coils.coils[index].belief = is_doubtful ? kBeliefOfDoubted : 1 - settings_.coil_faults.probability;
  }
  return coils;
}

void RecursiveEstimator::estimate(const Observation& observation, TubeEstimate& estimate) noexcept {
  begin_report(observation, estimate);
  images_ = ImageVerdict::kNone;
  const EmFrame* frame = observation.em->newest_until(observation.instant);
  CoilObservations coils = observe(frame, *observation.em);
  if (is_stale(frame, observation, settings_)) {
    estimate.reasons.add(Reason::kEmStale);
  } else {
    if (observation.is_image_instant && observation.instant < state_.time) {
      go_back(observation.instant);
    }
    advance(observation, *frame, coils, estimate);
    // The shape between images is as doubtful as the image left it.
    if (observation.is_image_instant) {
      state_.contradicted = images_ == ImageVerdict::kContradicts;
    } else if (state_.contradicted && images_ == ImageVerdict::kNone) {
      images_ = ImageVerdict::kContradicts;
    }
    if (state_.begun) {
      shape_time_ = observation.is_image_instant ? observation.instant : state_.time;
    }
  }
  const FoundShape shape{&map_.spline(),    state_.begun ? &shape_ : nullptr,
                         covariance_,       shape_time_,
                         variance_factor(), &state_.rival,
                         &agreement_};
  write_shape(shape, instrument_, estimate);
  add_reference_error(frame, *observation.em, T_world_em_, estimate);
  write_coils(coils, shape, estimate);
  write_held_by_coils(coils, estimate);
  write_held_by_images(observation, views_, estimate);
  write_measurements(frame, views_.newest_exposure(), estimate);
  const ImageVerdict standing = lost_tube_.standing(observation, images_);
  judge(observation, coils,
        {has_cameras_, registered_, converged_, standing, agreement_.disagree(), state_.is_ambiguous},
        estimate);
}

// To the newest state that is not younger than `time`. Without one the present state has to do.
void RecursiveEstimator::go_back(MonotonicTime time) {
  const State* best = nullptr;
  for (std::size_t age = kPastStates; age > 0; --age) {
    const State& past = past_[(next_past_ + kPastStates - age) % kPastStates];
    if (past.begun && past.time <= time && (best == nullptr || past.time >= best->time)) {
      best = &past;  // of two of one time what was made of it last
    }
  }
  if (best == nullptr) {
    return;
  }
  state_ = *best;
  for (State& past : past_) {
    past.begun = past.begun && past.time <= time;  // the younger ones have not seen this image
  }
}

void RecursiveEstimator::remember() {
  past_[next_past_] = state_;
  next_past_ = (next_past_ + 1) % kPastStates;
}

void RecursiveEstimator::advance(const Observation& observation, const EmFrame& newest,
                                 CoilObservations& coils, TubeEstimate& estimate) {
  const EmHistory& history = *observation.em;
  if (state_.begun && newest.measured - state_.newest_em > std::chrono::seconds(1)) {
    state_.begun = false;
    for (DoubtedCoil& doubted : state_.doubted) {
      doubted.contradicts_itself = false;  // that was long ago
    }
  }
  std::size_t waiting = 0;
  for (const EmFrame* frame = &newest;
       frame != nullptr && frame->measured > state_.newest_em && waiting < kMaxEmFrames;
       frame = history.before(&newest, waiting)) {
    ++waiting;
  }
  while (waiting > 0) {
    const EmFrame* frame = history.before(&newest, --waiting);
    state_.noise.observe(*frame, history, instrument_);
    const double interval_s = seconds_between(state_.newest_em, frame->measured);
    state_.newest_em = frame->measured;
    if (state_.begun) {
      update_coils(*frame, history, interval_s, estimate);
    }
  }
  // Of this state, whenever its newest measurement was taken.
  coils = observe(&newest, history);
  leave_out_doubted(coils);
  const bool too_sure = state_.begun && began_too_sure();
  if (state_.begun && !too_sure && !is_lost()) {
    if (registered_ && observation.is_image_instant) {
      predict(observation.instant, state_.freedom);
      update_image(observation, coils, estimate);
      shape_ = state_.C;
      judge_shape(observation, coils, estimate);
      state_.contradicted = images_ == ImageVerdict::kContradicts;
      if (state_.contradicted || images_ == ImageVerdict::kShowsTube) {
        remember();
      }
    } else {
      // A tick asks for a shape and leaves no trace: with or without it the next image finds the same state.
      shape_ = state_.C;
      if (settle(shape_, estimate)) know_covariance({});
    }
  }
  if (!state_.begun || too_sure || is_lost()) {
    coils = observe(&newest, history);
    leave_out_erratic(coils);
    initialise(observation, coils, newest, estimate);
  }
}

// Begun while all was taken for noise, and a part of it is not.
bool RecursiveEstimator::began_too_sure() {
  if (!state_.noise.known() || state_.began_with_known_noise) {
    return false;
  }
  const double whole_mm = state_.error_scale.position_mm();
  const double lasting_mm = state_.noise.lasting_position_mm(whole_mm);
  if (lasting_mm * lasting_mm > kNegligibleShare * whole_mm * whole_mm) {
    return true;
  }
  state_.began_with_known_noise = true;
  state_.usual = UsualSurprise{};
  return false;
}

void RecursiveEstimator::update_coils(const EmFrame& frame, const EmHistory& history, double interval_s,
                                      TubeEstimate& estimate) {
  CoilObservations coils = observe(&frame, history);
  before_update_ = state_;  // should the measurement say that the tube has moved otherwise
  predict(frame.measured, state_.freedom);
  const double freedom = freedom_for(judge_coils(coils, frame.measured, interval_s));
  const bool was_jerk = freedom > state_.freedom;
  if (was_jerk) {
    const UsualSurprise usual = state_.usual;
    state_ = before_update_;
    state_.usual = usual;
    coils = observe(&frame, history);
    predict(frame.measured, freedom);
    judge_coils(coils, frame.measured, interval_s);
  }
  state_.last_freedom = freedom;
  const CoilNoise& noise = state_.noise;
  state_.begun = coil_update_.apply(coils, map_, noise.noise_position_mm(), noise.noise_tangent(), state_.C,
                                    state_.m, state_.P);
  // Expected of a freer motion than usual it says nothing against the usual one.
  const CoilUpdate::Pull& pull = coil_update_.pull();
  adapt_freedom(was_jerk ? std::max(pull.chi_squared, pull.expected) : pull.chi_squared, pull.expected,
                interval_s);
  if (loose_tip_mm(coils, rest_) == 0) {
    state_.rival.setZero();
    state_.is_ambiguous = false;
  }
  learn_drift(interval_s);
  ask_alone(frame, history, interval_s);
  learn_bending_from_coils(estimate);
  remember();
}

void RecursiveEstimator::predict(MonotonicTime time, double freedom) {
  const double dt_s = seconds_between(state_.time, time);
  if (dt_s <= 0) {
    return;
  }
  state_.time = time;
  motion_.predict(dt_s, {sideways_freedom(freedom), state_.drift}, state_.C, state_.m, state_.P);
  age_coil_errors(dt_s);
}

// Images see the coefficients alone: theirs is all that has to be inverted, and the other columns follow.
bool RecursiveEstimator::refresh_information() {
  const Eigen::Index n = coefficients_.size();
  coefficient_prior_.mean = state_.m.leftCols(coefficients_.cols());
  coefficient_cholesky_.matrix() = state_.P.topLeftCorner(n, n);
  if (!coefficient_cholesky_.factorise() || !coefficient_cholesky_.invert(coefficient_prior_.information)) {
    state_.begun = false;  // numerically lost: begin again
    return false;
  }
  return true;
}

// What the coefficients' way from their prior mean says about the errors of coils and the speed.
void RecursiveEstimator::follow(Eigen::Matrix3Xd& C) {
  const Eigen::Index n = coefficients_.size();
  const Eigen::Index further = state_.P.rows() - n;
  C.leftCols(coefficients_.cols()) = coefficients_;
  depart(coefficients_);
  auto rest = C.rightCols(C.cols() - coefficients_.cols()).reshaped();
  rest = state_.m.rightCols(C.cols() - coefficients_.cols()).reshaped();
  rest.noalias() += state_.P.bottomLeftCorner(further, n) * information_times_departure_;
}

// The shape is what the measurements and the tube's stiffness make together.
bool RecursiveEstimator::settle(Eigen::Matrix3Xd& C, TubeEstimate& estimate) {
  if (!refresh_information()) {
    return false;
  }
  image_map_.set_bending(state_.bending);
  coefficients_ = C.leftCols(coefficients_.cols());
  refine({}, estimate);
  follow(C);
  return true;
}

void RecursiveEstimator::refine(std::span<const ViewConstraints> lines, TubeEstimate& estimate) {
  estimate.iterations += static_cast<std::uint32_t>(image_map_.refine(
      CoilObservations{}, lines, &coefficient_prior_, kUpdateIterations, coefficients_, converged_));
  converged_ = true;  // one step of Gauss-Newton from a prediction is as good as many
}

// Of the coefficients as they are now.
void RecursiveEstimator::know_covariance(std::span<const ViewConstraints> lines) {
  const bool known = image_map_.invert_at(CoilObservations{}, lines, &coefficient_prior_, coefficients_);
  covariance_ = known ? &image_map_ : nullptr;
}

}  // namespace tubed
