#include "daemon/estimator/recursive_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimator/report.hpp"

namespace tubed {

namespace {

// Motion, per root second for random walks. 0.95 mm is 0.2 mm in the 44 ms that a push of 1 mm takes at 22.5
// mm/s.
constexpr double kSideways_mm = 2.0;
constexpr double kSidewaysAtTip_mm = 4.3;
constexpr double kTipReach_mm = 30;        // over which the tip's freedom fades
constexpr double kSidewaysLength_mm = 25;  // correlation along the tube
constexpr double kSlidingSpeed_mm_s = 30;  // how fast it is pushed or pulled
// Stiffness is knowledge about every shape, not news of each frame: reapplied at full weight it would count
// again and again and make the filter sure of what it does not know.
constexpr double kStrainSigmaFactor = 18;
constexpr double kBendingFactor = 0.05;
constexpr double kImageVarianceFactor = 1;  // beside image_temper
// EM errors of neighbouring measurements are alike; as many as fit into this time count as one.
constexpr double kEmCorrelation_s = 0.1;
// Motion is set free when the coils say that more happens than was expected: a smoothed chi^2 per degree of
// freedom.
constexpr double kRestlessMemory_s = 0.3;
constexpr double kRestlessPower = 2;
constexpr double kRestlessFrom = 0.5;
constexpr double kRestlessMost = 20;
constexpr double kGate = 25;  // chi^2 of a coil's position, 3 dof: 1.5e-5
constexpr std::chrono::milliseconds kLostAfter{
    100};  // a coil that contradicts for so long is right and we are wrong
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
      map_(settings, instrument.length_mm),
      views_(settings, instrument, room),
      C_(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)),
      P_(Eigen::MatrixXd::Identity(3 * settings.coefficient_count, 3 * settings.coefficient_count)),
      prior_{P_, C_},
      factor_(P_),
      sideways_(settings.coefficient_count, settings.coefficient_count),
      departure_(Eigen::VectorXd::Zero(3 * settings.coefficient_count)),
      information_times_departure_(departure_),
      sliding_(departure_) {
  map_.set_stiffness(kStrainSigmaFactor, kBendingFactor);
  const double h = map_.spline().spacing_mm();
  const auto freedom = [h](int coefficient) {
    const double s_mm = std::max(0.0, (coefficient - 1) * h);
    return kSideways_mm + (kSidewaysAtTip_mm - kSideways_mm) * std::exp(-s_mm / kTipReach_mm);
  };
  for (int i = 0; i < settings.coefficient_count; ++i) {
    for (int j = 0; j < settings.coefficient_count; ++j) {
      const double distance = (i - j) * h / kSidewaysLength_mm;
      sideways_(i, j) = freedom(i) * freedom(j) * std::exp(-0.5 * distance * distance);
    }
  }
}

void RecursiveEstimator::reset() noexcept {
  views_.forget();
  has_state_ = false;
  has_covariance_ = false;
  gated_ = {};
  images_without_tube_ = 0;
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
    if (!has_state_ || observation.instant - state_time_ > std::chrono::seconds(1)) {
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

bool RecursiveEstimator::initialise(const Observation& observation, CoilObservations& coils,
                                    const EmFrame& frame, TubeEstimate& estimate) {
  gated_ = {};
  images_without_tube_ = 0;
  restlessness_ = 0;
  if (!start_.solve_em(coils, estimate)) {
    return false;
  }
  if (registered_) {
    images_ = start_.fuse_images(observation, coils, views_, estimate);
  }
  C_ = start_.C();
  converged_ = start_.converged();
  if (!start_.invert(observation, coils, views_)) {
    return false;
  }
  P_ = start_.map().coefficient_covariance();
  // map_ is asked for covariances: let it hold this one.
  factor_ = P_;
  prior_.mean = C_;
  has_covariance_ = refresh_information() && map_.invert_at(CoilObservations{}, {}, &prior_, C_);
  state_time_ = observation.is_image_instant ? observation.instant : frame.measured;
  newest_em_ = frame.measured;
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
    gate(coils, frame->measured, interval_s);
    map_.set_em_variance_factor(std::max(1.0, kEmCorrelation_s / std::max(interval_s, 1e-3)));
    update(coils, {}, estimate);
    newest_em_ = frame->measured;
  }
  if (registered_ && observation.is_image_instant) {
    predict(observation.instant);
    update_image(observation, estimate);
  }
  if (is_lost(state_time_)) {
    coils = observe(&newest, history);
    has_state_ = initialise(observation, coils, newest, estimate);
  }
}

// Random walk sideways; sliding along itself by an unknown length, the same all along the tube.
void RecursiveEstimator::predict(MonotonicTime time) {
  const double dt_s = seconds_between(state_time_, time);
  if (dt_s <= 0) {
    return;
  }
  state_time_ = time;
  const double h = map_.spline().spacing_mm();
  const Eigen::Index n = C_.cols();
  for (Eigen::Index i = 0; i < n; ++i) {
    // d zeta / d sliding = -zeta'(s): toward the tip. The coefficient's own place stands for the curve there.
    const Eigen::Index before = std::max<Eigen::Index>(i - 1, 0);
    const Eigen::Index after = std::min<Eigen::Index>(i + 1, n - 1);
    sliding_.segment<3>(3 * i) =
        -(C_.col(after) - C_.col(before)) / (static_cast<double>(after - before) * h);
  }
  const double freedom =
      std::clamp(std::pow(restlessness_ / kRestlessFrom, kRestlessPower), 1.0, kRestlessMost);
  const double slid_mm = kSlidingSpeed_mm_s * dt_s;
  P_.noalias() += slid_mm * slid_mm * sliding_ * sliding_.transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      P_.block<3, 3>(3 * i, 3 * j).diagonal().array() += sideways_(i, j) * dt_s * freedom;
    }
  }
}

bool RecursiveEstimator::refresh_information() {
  factor_ = P_;
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(factor_);
  if (cholesky.info() != Eigen::Success) {
    return false;
  }
  prior_.information.setIdentity();
  cholesky.solveInPlace(prior_.information);
  return true;
}

bool RecursiveEstimator::update(const CoilObservations& coils, std::span<const ViewConstraints> lines,
                                TubeEstimate& estimate) {
  prior_.mean = C_;
  if (!refresh_information()) {
    has_state_ = false;  // numerically lost: begin again with the next measurement
    return false;
  }
  estimate.iterations +=
      static_cast<std::uint32_t>(map_.refine(coils, lines, &prior_, kUpdateIterations, C_, converged_));
  has_covariance_ = map_.invert_at(coils, lines, &prior_, C_);
  if (has_covariance_) {
    P_ = map_.coefficient_covariance();
  }
  converged_ = true;  // one step of Gauss-Newton from a prediction is as good as many
  return true;
}

void RecursiveEstimator::update_image(const Observation& observation, TubeEstimate& estimate) {
  prior_.mean = C_;
  if (!refresh_information()) {
    has_state_ = false;
    return;
  }
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
  const auto lines = views_.constraints(observation, kImageVarianceFactor, true);
  has_covariance_ = map_.invert_at(CoilObservations{}, lines, &prior_, C_);
  if (has_covariance_) {
    P_ = map_.coefficient_covariance();
  }
}

// An image in which too few lines agree, or whose lines pull the prediction further than it can be wrong,
// shows something else: the prediction stays.
void RecursiveEstimator::judge_images(const Observation& observation, bool looked, TubeEstimate& estimate) {
  if (!looked || estimate.in_view_ratio <= 0) {
    return;
  }
  Eigen::Map<Eigen::Matrix3Xd>(departure_.data(), 3, C_.cols()) = C_ - prior_.mean;
  information_times_departure_.noalias() = prior_.information * departure_;
  const double pull = departure_.dot(information_times_departure_);
  const auto agreeing = static_cast<double>(estimate.image_inlier_ratio);
  if (agreeing >= kFewestAgreeing && (agreeing >= kDoubtfulAgreeing || pull < kDoubtfulPull)) {
    images_ = ImageVerdict::kShowsTube;
    images_without_tube_ = 0;
    return;
  }
  images_ = ImageVerdict::kLost;
  ++images_without_tube_;
  views_.forget_instant(observation.instant);
  estimate.has_image = false;
  C_ = prior_.mean;
}

Eigen::Matrix3d RecursiveEstimator::covariance_at(double s_mm) const {
  const CubicBasis basis = map_.spline().basis(s_mm);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      sum += basis.value[static_cast<std::size_t>(a)] * basis.value[static_cast<std::size_t>(b)] *
             P_.block<3, 3>(3 * (basis.first + a), 3 * (basis.first + b));
    }
  }
  return sum;
}

// A coil whose position the prediction cannot explain takes no part, for a while.
void RecursiveEstimator::gate(CoilObservations& coils, MonotonicTime time, double interval_s) {
  const double variance = settings_.sigma_position_mm * settings_.sigma_position_mm;
  double surprise = 0;
  int judged = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(coils.count); ++i) {
    CoilObservation& coil = coils.coils[i];
    if (!coil.used()) {
      continue;
    }
    const CubicBasis basis = map_.spline().basis(coil.s_mm);
    const Eigen::Vector3d innovation = coil.p_world_mm - combine(C_, basis.first, basis.value);
    const Eigen::Matrix3d expected = covariance_at(coil.s_mm) + variance * Eigen::Matrix3d::Identity();
    const double chi_squared = innovation.dot(expected.inverse() * innovation);
    surprise += std::min(chi_squared, kGate);
    ++judged;
    if (chi_squared <= kGate) {
      gated_[i] = GatedCoil{};
      continue;
    }
    coil.state = CoilState::kOutlier;
    gated_[i].since = gated_[i].times == 0 ? time : gated_[i].since;
    ++gated_[i].times;
  }
  if (judged > 0) {
    const double share = std::min(1.0, interval_s / kRestlessMemory_s);
    restlessness_ += share * (surprise / (3 * judged) - restlessness_);
  }
}

bool RecursiveEstimator::is_lost(MonotonicTime now) const {
  int gated_now = 0;
  for (const GatedCoil& coil : gated_) {
    gated_now += coil.times > 0 ? 1 : 0;
    if (coil.times > 1 && now - coil.since >= kLostAfter) {
      return true;
    }
  }
  return gated_now > 1 || images_without_tube_ >= kLostImages;
}

}  // namespace tubed
