#include "daemon/estimator/images/image_update.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/estimator/tip/loose_tip.hpp"

namespace tubed {

namespace {

constexpr double kImageVarianceFactor = 1;  // beside image_temper
constexpr double kDoubtfulPull = 60;        // chi^2 of the prediction against the image
constexpr double kJerk = 4;                 // chi^2 of a stretch of 20 mm
constexpr double kSureOfTip_px = ImageUpdate::kFirstReach_px / 2.0;
constexpr std::array<int, 2> kReaches_px = {ImageUpdate::kFirstReach_px, 5};

}  // namespace

ImageUpdate::ImageUpdate(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                         const RoomDescription& room, int column_count)
    : max_iterations_(settings.iterations),
      views_(settings, instrument, room),
      coefficients_(settings, instrument, column_count),
      mirror_test_(settings.coefficient_count),
      predicted_(Eigen::Matrix3Xd::Zero(3, column_count)) {}

void ImageUpdate::set_rest(RestHook* hook) {
  rest_ = hook;
  coefficients_.set_rest(hook);
}

bool ImageUpdate::settle(const TubeState& state, Eigen::Matrix3Xd& C, TubeEstimate& estimate) {
  if (!coefficients_.begin(state.tube, state.bending, C)) {
    return false;
  }
  estimate.iterations += coefficients_.refine({});
  coefficients_.follow(state.tube, C);
  return true;
}

ImageUpdate::Outcome ImageUpdate::apply(const Observation& observation, const CoilObservations& coils,
                                        Jerk jerk, TubeState& state, TubeEstimate& estimate) {
  TubeGaussian& tube = state.tube;
  Outcome outcome;
  if (!settle(state, tube.C, estimate)) {
    outcome.numerically_lost = true;
    return outcome;
  }
  predicted_ = tube.C;
  views_.look_from(observation);
  const double loose_mm = loose_tip_mm(coils, rest_);
  if (!coils.hold_tip() && rest_ == nullptr && (state.images.tip_is_missed || tip_is_out_of_reach(tube))) {
    trace_tip(observation, coils.first_used_mm(), state, estimate);
  }
  const TubePrediction prediction{&predicted_, &tube.P};
  bool looked = false;
  std::span<const ViewConstraints> lines;
  for (const int reach : kReaches_px) {
    looked =
        views_.measure(observation, map().spline(), coefficients_.coefficients(),
                       {reach, loose_mm == 0, 0, true, &prediction, LineSearch::Among::kNoise}, estimate);
    lines = views_.constraints(observation, kImageVarianceFactor, true);
    if (lines.empty()) break;
    if (jerk == Jerk::kAsked && loose_mm == 0 && reach == kFirstReach_px) {
      outcome.surprise = views_.surprise(observation.instant);
      if (outcome.surprise.chi2 > kJerk) {
        outcome.is_jerk = true;
        return outcome;
      }
    }
    estimate.iterations += coefficients_.refine(lines);
  }
  test_mirrored(lines, coils, estimate);
  coefficients_.follow(tube, tube.C);
  if (looked && estimate.in_view_ratio > 0 && !shows_tube(observation.instant, estimate, state)) {
    outcome.verdict = ImageVerdict::kLost;
    leave_out(observation.instant, state, estimate);
    lines = {};
  }
  if (lines.empty()) {
    coefficients_.set_coefficients(tube.C);
    return outcome;
  }
  return take(observation, lines, state);
}

ImageUpdate::Outcome ImageUpdate::take(const Observation& observation, std::span<const ViewConstraints> lines,
                                       TubeState& state) {
  ImageRecord& images = state.images;
  Outcome outcome;
  outcome.verdict = ImageVerdict::kShowsTube;
  outcome.lines = lines;
  outcome.interval_s = seconds_between(images.confirmed, observation.instant);
  images.without_tube = 0;
  images.confirmed = observation.instant;
  images.rival = mirror_test_.rival();
  images.is_ambiguous = mirror_test_.is_ambiguous();
  images.tip_is_missed = views_.misses_tip(observation.instant);
  views_.trust(observation);
  outcome.numerically_lost = !coefficients_.take(lines, state.tube);
  if (!outcome.numerically_lost) {
    outcome.pulled = coefficients_.pull(state.tube.m);
    outcome.expected = coefficients_.expected_pull(state.tube);
    coefficients_.set_coefficients(state.tube.C);
  }
  return outcome;
}

// It shows something else: the prediction stays.
void ImageUpdate::leave_out(MonotonicTime instant, TubeState& state, TubeEstimate& estimate) {
  state.images.without_tube += state.images.with_tube == 0 ? 1 : 0;
  views_.forget_instant(instant);
  estimate.has_image = false;
  state.tube.C = predicted_;
}

// Is it known so badly across itself that lines of the first reach may miss it?
bool ImageUpdate::tip_is_out_of_reach(const TubeGaussian& tube) const {
  const CubicBasis tip = map().spline().basis(0);
  const Eigen::Vector3d p_world_mm = combine(tube.C, tip.first, tip.value);
  const Eigen::Vector3d tangent_world = combine(tube.C, tip.first, tip.first_derivative);
  const Eigen::Matrix3d covariance_mm2 = tube.covariance_of(ColumnSum(tip), ColumnSum(tip));
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
void ImageUpdate::trace_tip(const Observation& observation, double loose_mm, TubeState& state,
                            TubeEstimate& estimate) {
  soften_loose_tip(loose_mm, map().spline().length_mm(), state.bending);
  coefficients_.set_bending(state.bending);
  trace_loose_tip(loose_mm, [&](double from_mm) {
    views_.measure(observation, map().spline(), coefficients_.coefficients(),
                   {kFirstReach_px, false, from_mm}, estimate);
    const auto lines = views_.constraints(observation, kImageVarianceFactor, true);
    if (lines.empty()) {
      return false;
    }
    estimate.iterations += coefficients_.refine(lines);
    return true;
  });
}

// As SingleFrameSolver does at a beginning, but against the prediction, which knows of the images before.
void ImageUpdate::test_mirrored(std::span<const ViewConstraints> lines, const CoilObservations& coils,
                                TubeEstimate& estimate) {
  mirror_test_.clear();
  const ViewConstraints* const view = view_of_tip(lines);
  const double loose_mm = loose_tip_mm(coils, rest_);
  if (loose_mm == 0 || view == nullptr) {
    return;
  }
  mirror_test_.run({*view->camera, map().spline(), loose_mm, coefficients_.cost(),
                    show_tip_from_two_sides(lines, loose_mm)},
                   coefficients_.coefficients(), [&](Eigen::Matrix3Xd& C) {
                     estimate.iterations += coefficients_.refine(lines, max_iterations_, C);
                     return coefficients_.cost();
                   });
}

// A short piece that was not seen before is believed at the third image in a row.
bool ImageUpdate::shows_tube(MonotonicTime instant, const TubeEstimate& estimate, TubeState& state) {
  int& with_tube = state.images.with_tube;
  const auto agreeing = static_cast<double>(estimate.image_inlier_ratio);
  if (agreeing < SingleFrameSolver::kMinAgreeing || (agreeing < SingleFrameSolver::kDoubtfulAgreeing &&
                                                     coefficients_.pull(state.tube.C) >= kDoubtfulPull)) {
    with_tube = 0;
    return false;
  }
  const bool is_by_itself = !views_.may_agree_by_chance(instant);
  with_tube = is_by_itself ? kConfirming : std::min(with_tube + 1, kConfirming);
  return with_tube == kConfirming;
}

}  // namespace tubed
