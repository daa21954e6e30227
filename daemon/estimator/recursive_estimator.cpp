#include "daemon/estimator/recursive_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimator/report.hpp"

namespace tubed {

namespace {

constexpr double kNoStrain = 1e3;           // sigma factor that switches it off
constexpr double kImageVarianceFactor = 1;  // beside image_temper
// A coil's lasting error changes as the coil moves through the field.
constexpr double kErrorLength_mm = 1000;
// Motion is as free as the measurements say: chi^2 of how far they pull, a degree of freedom, should be 1.
constexpr double kFreedomMemory_s = 0.5;
constexpr double kFreedomLeast = 1;
constexpr double kFreedomMost = 10;
constexpr double kGate = 25;          // chi^2 of a coil's position, 3 dof: 1.5e-5
constexpr double kLostAfter_s = 0.5;  // when a few coils contradict and no image says who is right
constexpr double kLostThoughConfirmed_s = 5;
constexpr double kConfirmedFor_s = 0.5;
constexpr int kLostImages = 3;
constexpr double kFewestAgreeing = 0.62;  // share of lines; as in SingleFrameSolver
constexpr double kDoubtfulAgreeing = 0.78;
constexpr double kDoubtfulPull = 60;  // chi^2 of the prediction against the image
constexpr std::array<int, 2> kReaches_px = {10, 5};
constexpr int kUpdateIterations = 3;
constexpr std::size_t kMostEmFrames = 16;  // a longer gap is bridged by the newest ones

}  // namespace

RecursiveEstimator::RecursiveEstimator(const EstimatorSettings& settings,
                                       const InstrumentDescription& instrument, const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      T_world_em_(room.T_world_em),
      registered_(room.registered),
      start_(settings, instrument.length_mm),
      map_(settings, instrument.length_mm, static_cast<int>(instrument.coils.size()), 1),
      views_(settings, instrument, room),
      motion_(map_.spline(), map_.column_count()),
      noise_(settings),
      C_(Eigen::Matrix3Xd::Zero(3, map_.column_count())),
      C_before_(C_),
      m_(C_),
      P_(Eigen::MatrixXd::Identity(C_.size(), C_.size())),
      prior_{P_, C_},
      factor_(P_),
      departure_(Eigen::VectorXd::Zero(C_.size())),
      information_times_departure_(departure_) {}

void RecursiveEstimator::reset() noexcept {
  views_.forget();
  noise_.reset();
  has_state_ = false;
  has_covariance_ = false;
  gated_ = {};
  images_without_tube_ = 0;
  heard_ = MonotonicTime{};
}

CoilObservations RecursiveEstimator::observe(const EmFrame* frame, const EmHistory& history) const {
  return observe_coils(frame, history, instrument_, T_world_em_,
                       static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
}

void RecursiveEstimator::estimate(const Observation& observation, TubeEstimate& estimate) noexcept {
  begin_report(observation, estimate);
  images_ = ImageVerdict::kNone;
  const EmFrame* frame = observation.em->newest_until(observation.instant);
  CoilObservations coils = observe(frame, *observation.em);
  if (is_stale(frame, observation, settings_)) {
    estimate.reasons.add(Reason::kEmStale);
  } else {
    listen(observation, *frame);
    // Begun while all was taken for noise: too sure of itself if it is not.
    const bool began_blind = has_state_ && noise_.known() && !began_with_known_noise_;
    if (!has_state_ || began_blind || observation.instant - state_time_ > std::chrono::seconds(1)) {
      has_state_ = initialise(observation, coils, *frame, estimate);
    } else {
      advance(observation, *frame, coils, estimate);
    }
    if (has_state_) {
      shape_time_ = observation.is_image_instant ? observation.instant : state_time_;
    }
  }
  const FoundShape shape{&map_.spline(), has_state_ ? &C_ : nullptr, has_covariance_ ? &map_ : nullptr,
                         shape_time_};
  write_shape(shape, instrument_, estimate);
  write_coils(coils, shape, estimate);
  write_ages(observation, frame, views_.newest_exposure(), estimate);
  judge(observation, coils, {true, registered_, converged_, images_}, estimate);
}

void RecursiveEstimator::listen(const Observation& observation, const EmFrame& newest) {
  const EmHistory& history = *observation.em;
  std::size_t waiting = 0;
  for (const EmFrame* frame = &newest;
       frame != nullptr && frame->measured > heard_ && waiting < kMostEmFrames;
       frame = history.before(&newest, waiting)) {
    ++waiting;
  }
  while (waiting > 0) {
    noise_.observe(*history.before(&newest, --waiting), history, instrument_);
  }
  heard_ = newest.measured;
}

bool RecursiveEstimator::initialise(const Observation& observation, CoilObservations& coils,
                                    const EmFrame& frame, TubeEstimate& estimate) {
  gated_ = {};
  images_without_tube_ = 0;
  freedom_ = 1;
  if (!start_.solve_em(coils, estimate)) {
    return false;
  }
  if (registered_) {
    images_ = start_.fuse_images(observation, coils, views_, estimate);
  }
  const Eigen::Index n = start_.C().cols();
  const auto k = static_cast<Eigen::Index>(instrument_.coils.size());
  began_with_known_noise_ = noise_.known();
  lasting_position_mm_ = noise_.lasting_position_mm();
  lasting_tangent_ = noise_.lasting_tangent();
  C_.setZero();
  C_.leftCols(n) = start_.C();
  prior_.mean.setZero();
  prior_.information.setZero();
  prior_.information.diagonal()
      .segment(3 * n, 3 * k)
      .setConstant(1 / (lasting_position_mm_ * lasting_position_mm_));
  prior_.information.diagonal()
      .segment(3 * (n + k), 3 * k)
      .setConstant(1 / (lasting_tangent_ * lasting_tangent_));
  prior_.information.diagonal().tail<3>().setOnes();
  map_.set_stiffness(1, 1);
  map_.set_coil_noise(noise_.noise_position_mm(), noise_.noise_tangent());
  const auto lines = views_.constraints(observation, 1, false);
  estimate.iterations +=
      static_cast<std::uint32_t>(map_.refine(coils, lines, &prior_, settings_.iterations, C_, converged_));
  map_.set_stiffness(kNoStrain, 1);
  if (!map_.invert_at(coils, lines, &prior_, C_)) {
    return false;
  }
  P_ = map_.coefficient_covariance();
  motion_.begin(C_, P_);
  m_ = C_;
  map_.set_stiffness(1, 1);
  has_covariance_ = map_.invert_at(coils, lines, &prior_, C_);
  state_time_ = observation.is_image_instant ? observation.instant : frame.measured;
  newest_em_ = frame.measured;
  for (std::size_t i = 0; i < instrument_.coils.size(); ++i) {
    const CubicBasis basis = map_.spline().basis(instrument_.coils[i].offset_from_tip_mm);
    coil_places_mm_[i] = combine(C_, basis.first, basis.value);
  }
  return true;
}

void RecursiveEstimator::advance(const Observation& observation, const EmFrame& newest,
                                 CoilObservations& coils, TubeEstimate& estimate) {
  const EmHistory& history = *observation.em;
  std::size_t waiting = 0;
  for (const EmFrame* frame = &newest;
       frame != nullptr && frame->measured > newest_em_ && waiting < kMostEmFrames;
       frame = history.before(&newest, waiting)) {
    ++waiting;
  }
  while (waiting > 0) {
    const EmFrame* frame = history.before(&newest, --waiting);
    const double interval_s = seconds_between(newest_em_, frame->measured);
    coils = observe(frame, history);
    predict(frame->measured);
    gate(coils, frame->measured);
    update(coils, {}, interval_s, estimate);
    newest_em_ = frame->measured;
  }
  if (registered_ && observation.is_image_instant) {
    predict(observation.instant);
    update_image(observation, estimate);
  }
  if (!has_state_ || is_lost(state_time_)) {
    coils = observe(&newest, history);
    has_state_ = initialise(observation, coils, newest, estimate);
  }
}

void RecursiveEstimator::predict(MonotonicTime time) {
  const double dt_s = seconds_between(state_time_, time);
  if (dt_s <= 0) {
    return;
  }
  state_time_ = time;
  motion_.predict(dt_s, freedom_, C_, m_, P_);
  forget_coil_errors();
}

// A Gauss-Markov process over the way each coil has gone. If more of the error turns out to stay than was
// thought, that much is added.
void RecursiveEstimator::forget_coil_errors() {
  const double was_position_mm = lasting_position_mm_;
  const double was_tangent = lasting_tangent_;
  lasting_position_mm_ = noise_.lasting_position_mm();
  lasting_tangent_ = noise_.lasting_tangent();
  for (std::size_t i = 0; i < instrument_.coils.size(); ++i) {
    const CubicBasis basis = map_.spline().basis(instrument_.coils[i].offset_from_tip_mm);
    const Eigen::Vector3d place_mm = combine(C_, basis.first, basis.value);
    const double kept = std::exp(-(place_mm - coil_places_mm_[i]).norm() / kErrorLength_mm);
    coil_places_mm_[i] = place_mm;
    const auto age = [&](int column, double sigma, double was) {
      C_.col(column) *= kept;
      m_.col(column) *= kept;
      P_.middleRows<3>(3 * column) *= kept;
      P_.middleCols<3>(3 * column) *= kept;
      P_.block<3, 3>(3 * column, 3 * column).diagonal().array() +=
          (1 - kept * kept) * sigma * sigma + std::max(0.0, sigma * sigma - was * was);
    };
    age(map_.position_error_column(static_cast<int>(i)), lasting_position_mm_, was_position_mm);
    age(map_.tangent_error_column(static_cast<int>(i)), lasting_tangent_, was_tangent);
  }
}

bool RecursiveEstimator::refresh_information() {
  prior_.mean = m_;
  factor_ = P_;
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(factor_);
  if (cholesky.info() != Eigen::Success) {
    has_state_ = false;  // numerically lost: begin again with the next measurement
    return false;
  }
  prior_.information.setIdentity();
  cholesky.solveInPlace(prior_.information);
  return true;
}

bool RecursiveEstimator::update(const CoilObservations& coils, std::span<const ViewConstraints> lines,
                                double interval_s, TubeEstimate& estimate) {
  if (!refresh_information()) {
    return false;
  }
  map_.set_coil_noise(noise_.noise_position_mm(), noise_.noise_tangent());
  estimate.iterations +=
      static_cast<std::uint32_t>(map_.refine(coils, lines, &prior_, kUpdateIterations, C_, converged_));
  converged_ = true;  // one step of Gauss-Newton from a prediction is as good as many
  return keep(coils, lines, interval_s);
}

// The measurements go on as a Gaussian; the shape is what they and the tube's stiffness make together.
bool RecursiveEstimator::keep(const CoilObservations& coils, std::span<const ViewConstraints> lines,
                              double interval_s) {
  if (!map_.condense(coils, lines, prior_, C_, m_)) {
    has_state_ = false;
    return false;
  }
  P_ = map_.coefficient_covariance();
  adapt_freedom(interval_s);
  has_covariance_ = map_.invert_at(coils, lines, &prior_, C_);
  return true;
}

void RecursiveEstimator::update_image(const Observation& observation, TubeEstimate& estimate) {
  if (!refresh_information()) {
    return;
  }
  const double interval_s = seconds_between(confirmed_, observation.instant);
  C_before_ = C_;
  bool looked = false;
  for (const int reach : kReaches_px) {
    looked = views_.measure(observation, map_.spline(), C_, reach, estimate);
    const auto lines = views_.constraints(observation, kImageVarianceFactor, true);
    if (lines.empty()) {
      break;
    }
    estimate.iterations += static_cast<std::uint32_t>(
        map_.refine(CoilObservations{}, lines, &prior_, kUpdateIterations, C_, converged_));
  }
  converged_ = true;
  judge_images(observation, looked, estimate);
  keep(CoilObservations{}, views_.constraints(observation, kImageVarianceFactor, true), interval_s);
}

// chi^2 of the way from the prediction.
double RecursiveEstimator::pull(const Eigen::Matrix3Xd& C) {
  Eigen::Map<Eigen::Matrix3Xd>(departure_.data(), 3, C_.cols()) = C - prior_.mean;
  information_times_departure_.noalias() = prior_.information * departure_;
  return departure_.dot(information_times_departure_);
}

// With the right process noise an update pulls the mean by chi^2 = 3n - tr(P-^-1 P+) in expectation.
void RecursiveEstimator::adapt_freedom(double interval_s) {
  const double expected = static_cast<double>(C_.size()) - prior_.information.cwiseProduct(P_).sum();
  if (expected < 1) {
    return;
  }
  const double ratio = std::clamp(pull(m_) / expected, 0.1, 10.0);
  const double share = std::clamp(interval_s / kFreedomMemory_s, 0.0, 1.0);
  freedom_ = std::clamp(freedom_ * std::pow(ratio, share), kFreedomLeast, kFreedomMost);
}

// An image in which too few lines agree, or whose lines pull the prediction further than it can be wrong,
// shows something else: the prediction stays.
void RecursiveEstimator::judge_images(const Observation& observation, bool looked, TubeEstimate& estimate) {
  if (!looked || estimate.in_view_ratio <= 0) {
    return;
  }
  const auto agreeing = static_cast<double>(estimate.image_inlier_ratio);
  if (agreeing >= kFewestAgreeing && (agreeing >= kDoubtfulAgreeing || pull(C_) < kDoubtfulPull)) {
    images_ = ImageVerdict::kShowsTube;
    images_without_tube_ = 0;
    confirmed_ = observation.instant;
    return;
  }
  images_ = ImageVerdict::kLost;
  ++images_without_tube_;
  views_.forget_instant(observation.instant);
  estimate.has_image = false;
  C_ = C_before_;
}

Eigen::Matrix3d RecursiveEstimator::innovation_covariance(const CoilObservation& coil, int index) const {
  const CubicBasis basis = map_.spline().basis(coil.s_mm);
  std::array<Eigen::Index, 5> columns{};
  std::array<double, 5> weights{};
  for (std::size_t a = 0; a < 4; ++a) {
    columns[a] = basis.first + static_cast<Eigen::Index>(a);
    weights[a] = basis.value[a];
  }
  columns[4] = map_.position_error_column(index);
  weights[4] = 1;
  const double noise_mm = noise_.noise_position_mm();
  Eigen::Matrix3d sum = noise_mm * noise_mm * Eigen::Matrix3d::Identity();
  for (std::size_t a = 0; a < 5; ++a) {
    for (std::size_t b = 0; b < 5; ++b) {
      sum += weights[a] * weights[b] * P_.block<3, 3>(3 * columns[a], 3 * columns[b]);
    }
  }
  return sum;
}

// A coil whose position the prediction cannot explain takes no part, for a while.
void RecursiveEstimator::gate(CoilObservations& coils, MonotonicTime time) {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    GatedCoil& gated = gated_[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      gated = GatedCoil{};
      continue;
    }
    const CubicBasis basis = map_.spline().basis(coil.s_mm);
    const Eigen::Vector3d innovation =
        coil.p_world_mm - combine(C_, basis.first, basis.value) - C_.col(map_.position_error_column(i));
    const double chi_squared = innovation.dot(innovation_covariance(coil, i).inverse() * innovation);
    if (chi_squared <= kGate) {
      gated = GatedCoil{};
      continue;
    }
    coil.state = CoilState::kOutlier;
    gated.since = gated.times == 0 ? time : gated.since;
    ++gated.times;
  }
}

// When most coils contradict, the tube has snapped and they are right. When a few do, images that show the
// tube where it is expected speak against them for a long while, but not for ever: they do not see depth.
bool RecursiveEstimator::is_lost(MonotonicTime now) const {
  int gated_now = 0;
  double longest_s = 0;
  for (const GatedCoil& coil : gated_) {
    if (coil.times > 0) {
      ++gated_now;
      longest_s = std::max(longest_s, seconds_between(coil.since, now));
    }
  }
  const bool confirmed = to_ns(confirmed_) != 0 && seconds_between(confirmed_, now) < kConfirmedFor_s;
  return 2 * gated_now > static_cast<int>(instrument_.coils.size()) ||
         (gated_now > 0 && longest_s >= (confirmed ? kLostThoughConfirmed_s : kLostAfter_s)) ||
         images_without_tube_ >= kLostImages;
}

}  // namespace tubed
