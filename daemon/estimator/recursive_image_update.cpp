// What an image says to the recursive estimator.
#include <algorithm>
#include <cmath>

#include "daemon/estimator/loose_tip.hpp"
#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

constexpr double kImageVarianceFactor = 1;  // beside image_temper
constexpr double kDoubtfulPull = 60;        // chi^2 of the prediction against the image
constexpr double kSureOfTip_px = RecursiveEstimator::kFirstReach_px / 2.0;
constexpr std::array<int, 2> kReaches_px = {RecursiveEstimator::kFirstReach_px, 5};
// Motion is as free as the measurements say: chi^2 of how far they pull, a degree of freedom, should be 1.
constexpr double kFreedomMemory_s = 0.5;
constexpr double kMinFreedom = 0.4;
constexpr double kMaxFreedom = 10;
constexpr double kMinSideways = 0.25;
constexpr double kMinDrift = 0.05;
// At kMinFreedom updates pull by less than is expected: motion is calmer than the filter lets it be, who
// would lag behind the next jerk otherwise.
constexpr double kCalmVariance = 0.71;

}  // namespace

// The lines' posterior of the coefficients into the state; P_ec P_cc^-1 stays as it was before.
bool RecursiveEstimator::take_lines(std::span<const ViewConstraints> lines) {
  const Eigen::Index n = coefficients_.size();
  const Eigen::Index further = state_.P.rows() - n;
  auto P_cc = state_.P.topLeftCorner(n, n);
  auto P_ec = state_.P.bottomLeftCorner(further, n);
  if (!image_map_.condense(CoilObservations{}, lines, coefficient_prior_, coefficients_, coefficients_)) {
    return false;
  }
  follow(state_.m);
  following_.noalias() = P_ec * coefficient_prior_.information;
  P_cc = image_map_.coefficient_covariance();
  following_covariance_.noalias() = following_ * P_cc;
  P_ec -= following_covariance_;
  state_.P.bottomRightCorner(further, further).noalias() -= P_ec * following_.transpose();
  P_ec = following_covariance_;
  state_.P.topRightCorner(n, further) = following_covariance_.transpose();
  return true;
}

// An image in which too few lines agree, or whose lines pull the prediction further than it can be wrong,
// shows something else: the prediction stays.
void RecursiveEstimator::update_image(const Observation& observation, const CoilObservations& coils,
                                      TubeEstimate& estimate) {
  if (!settle(state_.C, estimate)) {
    return;
  }
  C_before_ = state_.C;
  views_.look_from(observation);
  const double loose_mm = loose_tip_mm(coils, rest_);
  if (!coils.hold_tip() && rest_ == nullptr && (state_.tip_is_missed || tip_is_out_of_reach())) {
    trace_tip(observation, coils.first_used_mm(), estimate);
  }
  const TubePrediction prediction{&C_before_, &state_.P};
  bool looked = false;
  std::span<const ViewConstraints> lines;
  for (const int reach : kReaches_px) {
    looked = views_.measure(observation, map_.spline(), coefficients_,
                            {reach, loose_mm == 0, 0, true, &prediction}, estimate);
    lines = views_.constraints(observation, kImageVarianceFactor, true);
    if (lines.empty()) break;
    refine(lines, estimate);
  }
  test_mirrored(lines, coils, estimate);
  follow(state_.C);
  if (looked && estimate.in_view_ratio > 0 && !shows_tube(observation.instant, estimate)) {
    leave_out_image(observation.instant, estimate);
    lines = {};
  }
  if (lines.empty()) {
    coefficients_ = state_.C.leftCols(coefficients_.cols());
    know_covariance({});
    return;
  }
  const double interval_s = seconds_between(state_.confirmed, observation.instant);
  images_ = ImageVerdict::kShowsTube;
  state_.images_without_tube = 0;
  state_.confirmed = observation.instant;
  state_.rival = mirror_test_.rival();
  state_.is_ambiguous = mirror_test_.is_ambiguous();
  state_.tip_is_missed = views_.misses_tip(observation.instant);
  views_.trust(observation);
  if (!take_lines(lines)) {
    state_.begun = false;
    return;
  }
  coefficients_ = state_.C.leftCols(coefficients_.cols());
  know_covariance(lines);
  learn_bending(state_.C);
  // With the right process noise an update pulls the mean by chi^2 = 3n - tr(P-^-1 P+) in expectation.
  const Eigen::Index n = coefficients_.size();
  adapt_freedom(pull(state_.m),
                static_cast<double>(n) -
                    coefficient_prior_.information.cwiseProduct(state_.P.topLeftCorner(n, n)).sum(),
                interval_s);
  learn_drift(interval_s);
  state_.error_scale.observe(coils, state_.noise, lines, map_.spline(), state_.C, interval_s);
  agreement_.observe(coils, {observation.instant, map_.spline(), state_.C, lines},
                     state_.noise.noise_position_mm(),
                     state_.noise.lasting_position_mm(settings_.sigma_position_mm));
}

// It shows something else: the prediction stays.
void RecursiveEstimator::leave_out_image(MonotonicTime instant, TubeEstimate& estimate) {
  images_ = ImageVerdict::kLost;
  state_.images_without_tube += state_.images_with_tube == 0 ? 1 : 0;
  views_.forget_instant(instant);
  estimate.has_image = false;
  state_.C = C_before_;
}

// Is it known so badly across itself that lines of the first reach may miss it?
bool RecursiveEstimator::tip_is_out_of_reach() const {
  const CubicBasis tip = map_.spline().basis(0);
  const Eigen::Vector3d p_world_mm = combine(state_.C, tip.first, tip.value);
  const Eigen::Vector3d tangent_world = combine(state_.C, tip.first, tip.first_derivative);
  const Eigen::Matrix3d covariance_mm2 = covariance_of(ColumnSum(tip), ColumnSum(tip));
  for (std::size_t view = 0; view < views_.count(); ++view) {
    const auto here = views_.camera(view).project(p_world_mm);
    if (!here || !views_.camera(view).contains(here->p_image_px)) {
      continue;
    }
    const Eigen::Vector2d along = (here->J_image_world * tangent_world).normalized();
    const Eigen::Vector2d across(-along.y(), along.x());
    const Eigen::Vector3d gradient = here->J_image_world.transpose() * across;
    if (gradient.dot(covariance_mm2 * gradient) > kSureOfTip_px * kSureOfTip_px) {
      return true;
    }
  }
  return false;
}

// As SingleFrameSolver does at a beginning, from the prediction.
void RecursiveEstimator::trace_tip(const Observation& observation, double loose_mm, TubeEstimate& estimate) {
  soften_loose_tip(loose_mm, map_.spline().length_mm(), state_.bending);
  image_map_.set_bending(state_.bending);
  trace_loose_tip(loose_mm, [&](double from_mm) {
    views_.measure(observation, map_.spline(), coefficients_, {kFirstReach_px, false, from_mm}, estimate);
    const auto lines = views_.constraints(observation, kImageVarianceFactor, true);
    if (lines.empty()) {
      return false;
    }
    refine(lines, estimate);
    return true;
  });
}

// As SingleFrameSolver does at a beginning, but against the prediction, which knows of the images before.
void RecursiveEstimator::test_mirrored(std::span<const ViewConstraints> lines, const CoilObservations& coils,
                                       TubeEstimate& estimate) {
  mirror_test_.clear();
  const ViewConstraints* const view = view_of_tip(lines);
  const double loose_mm = loose_tip_mm(coils, rest_);
  if (loose_mm == 0 || view == nullptr) {
    return;
  }
  mirror_test_.run(
      {*view->camera, map_.spline(), loose_mm, image_map_.cost(), show_tip_from_two_sides(lines, loose_mm)},
      coefficients_, [&](Eigen::Matrix3Xd& C) {
        bool converged = false;
        estimate.iterations += static_cast<std::uint32_t>(image_map_.refine(
            CoilObservations{}, lines, &coefficient_prior_, settings_.iterations, C, converged));
        return image_map_.cost();
      });
}

// A short piece that was not seen before is believed at the third image in a row.
bool RecursiveEstimator::shows_tube(MonotonicTime instant, const TubeEstimate& estimate) {
  const auto agreeing = static_cast<double>(estimate.image_inlier_ratio);
  if (agreeing < SingleFrameSolver::kMinAgreeing ||
      (agreeing < SingleFrameSolver::kDoubtfulAgreeing && pull(state_.C) >= kDoubtfulPull)) {
    state_.images_with_tube = 0;
    return false;
  }
  const bool is_by_itself = !views_.may_agree_by_chance(instant);
  state_.images_with_tube = is_by_itself ? kConfirming : std::min(state_.images_with_tube + 1, kConfirming);
  return state_.images_with_tube == kConfirming;
}

// chi^2 of the way from the prediction; columns that follow add nothing to it.
double RecursiveEstimator::pull(const Eigen::Matrix3Xd& C) {
  depart(C);
  return departure_.dot(information_times_departure_);
}

// departure_ of C's coefficients from their prior mean, and with the information.
void RecursiveEstimator::depart(const Eigen::Matrix3Xd& C) {
  departure_ = (C.leftCols(coefficients_.cols()) - coefficient_prior_.mean).reshaped();
  information_times_departure_.noalias() = coefficient_prior_.information * departure_;
}

void RecursiveEstimator::adapt_freedom(double pulled, double expected, double interval_s) {
  if (expected < 1) {
    return;
  }
  const double ratio = std::clamp(pulled / expected, 0.1, 10.0);
  const double share = std::clamp(interval_s / kFreedomMemory_s, 0.0, 1.0);
  state_.freedom = std::clamp(state_.freedom * std::pow(ratio, share), min_freedom(), kMaxFreedom);
}

// Where coils err by noise, a tube held firmer averages more of it. Where their errors stay there is nothing
// to average, and what they do from place to place would be held instead.
double RecursiveEstimator::lasting_share() const {
  const double share = state_.lasting_position_mm / state_.error_scale.position_mm();
  return share * share;
}

double RecursiveEstimator::min_freedom() const { return std::clamp(lasting_share(), kMinFreedom, 1.0); }

double RecursiveEstimator::sideways_freedom(double learnt) const {
  return learnt * std::clamp(lasting_share(), kMinSideways, 1.0);
}

void RecursiveEstimator::learn_drift(double interval_s) {
  motion_.learn_drift(interval_s, std::clamp(lasting_share(), kMinDrift, 1.0), state_.m, state_.P,
                      state_.drift);
}

// So that sigma does not say more than it has to while motion is calm.
double RecursiveEstimator::variance_factor() const {
  const double calm =
      std::clamp((1 - std::max(state_.freedom, state_.last_freedom)) / (1 - kMinFreedom), 0.0, 1.0);
  return 1 - (1 - kCalmVariance) * calm;
}

}  // namespace tubed
