#include "daemon/estimator/single_frame_solver.hpp"

#include <algorithm>
#include <array>

#include "daemon/estimator/tip/loose_tip.hpp"

namespace tubed {

namespace {

constexpr std::array<int, 3> kRoundDivisors = {1, 2,
                                               3};  // reach of each round's lines: image_search_px / this
constexpr double kDoubtfulPullOfCoil = 2.4;         // chi^2, 5 degrees of freedom: see SingleFrameSolver
constexpr double kMaxPull = 8;

}  // namespace

SingleFrameSolver::SingleFrameSolver(const EstimatorSettings& settings,
                                     const InstrumentDescription& instrument)
    : settings_(settings),
      map_(settings, instrument.length_mm),
      C_(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)),
      C_em_(C_),
      bending_(Eigen::VectorXd::Ones(map_.bending_node_count())),
      C_without_(C_),
      mirror_test_(C_.cols()) {
  map_.set_stiffness(instrument.stiffness_profile());
}

bool SingleFrameSolver::solve_em(CoilObservations& coils, TubeEstimate& estimate) {
  bending_.setOnes();
  map_.set_bending(bending_);
  map_.set_rest(nullptr);
  mirror_test_.clear();
  if (!map_.solve_linear(coils, C_)) {
    return false;
  }
  estimate.iterations +=
      static_cast<std::uint32_t>(map_.refine(coils, {}, nullptr, settings_.iterations, C_, converged_));
  // A coil in a hook contradicts a straight tip, and need not be wrong: it is asked with the hook.
  const bool is_held = rest_ != nullptr && rest_->is_held_by(coils.first_used_mm());
  if (!is_held) {
    reject_outlier(coils);
  }
  if (rest_ != nullptr) {
    map_.set_rest(rest_);
    map_.solve_linear(coils, C_);
    estimate.iterations +=
        static_cast<std::uint32_t>(map_.refine(coils, {}, nullptr, settings_.iterations, C_, converged_));
  }
  if (is_held) {
    reject_outlier(coils);
  }
  return true;
}

// A coil that reports OK but contradicts the others: leaving it out must save more than its prior belief
// costs. With fewer than four usable coils there is no majority to ask.
void SingleFrameSolver::reject_outlier(CoilObservations& coils) {
  if (coils.used_count() < kMinForMajority) {
    return;
  }
  const double cost = map_.contradiction(coils, C_);
  double max_saved = 1;  // of what makes it an outlier
  int outlier = -1;
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    const double gain = gain_to_leave_out(settings_.coil_faults, coil.belief, settings_.sigma_position_mm);
    if (!coil.used() || cost < max_saved * gain) {  // cheap way out: it cannot save so much
      continue;
    }
    coil.state = CoilState::kOutlier;
    bool converged = false;
    if (map_.solve_linear(coils, C_without_)) {
      map_.refine(coils, {}, nullptr, settings_.iterations, C_without_, converged);
      const double saved = (cost - map_.contradiction(coils, C_without_)) / gain;
      if (saved > max_saved) {
        max_saved = saved;
        outlier = i;
      }
    }
    coil.state = CoilState::kUsed;
  }
  if (outlier >= 0) {
    coils.coils[static_cast<std::size_t>(outlier)].state = CoilState::kOutlier;
    map_.solve_linear(coils, C_);
    map_.refine(coils, {}, nullptr, settings_.iterations, C_, converged_);
  }
}

ImageVerdict SingleFrameSolver::fuse_images(const Observation& observation, const CoilObservations& coils,
                                            TubeViews& views, Asked asked, TubeEstimate& estimate) {
  C_em_ = C_;
  const double coil_cost_before = map_.contradiction(coils, C_);
  const bool predicts = asked == Asked::kToBegin && map_.invert_at(coils, {}, nullptr, C_);
  const TubePrediction prediction{&C_em_, &map_.coefficient_covariance()};
  trace_tip(observation, coils, views, estimate);
  if (asked != Asked::kSecondOpinion) trace_tail(observation, coils, views, estimate);
  const bool is_second = asked == Asked::kSecondOpinion || asked == Asked::kSecondOpinionOnTail;
  for (const int divisor : kRoundDivisors) {
    const int reach =
        std::clamp(static_cast<int>(settings_.image_search_px) / divisor, 3, LineSearch::kMaxReach);
    const bool looked =
        views.measure(observation, map_.spline(), C_,
                      {.reach_px = reach,
                       .tip_is_held = loose_tip_mm(coils, rest_) == 0,
                       .prediction = predicts ? &prediction : nullptr,
                       .among = is_second ? LineSearch::Among::kNoise : LineSearch::Among::kTubes},
                      estimate);
    const auto lines = views.constraints(observation, 1, false);
    if (!lines.empty()) {
      estimate.iterations += static_cast<std::uint32_t>(
          map_.refine(coils, lines, nullptr, settings_.iterations, C_, converged_));
    }
    if (!looked) {  // only lines of an earlier image: one round is all they can give
      return pull_on(coils, coil_cost_before) > kMaxPull ? ImageVerdict::kContradicts : ImageVerdict::kNone;
    }
  }
  test_mirrored(observation, coils, views, estimate);
  const bool may_be_chance = asked != Asked::kOnce && views.may_agree_by_chance(observation.instant);
  const ImageVerdict verdict = judge_images(coils, coil_cost_before, may_be_chance, estimate);
  if (verdict == ImageVerdict::kLost) {
    views.forget_instant(observation.instant);
    estimate.has_image = false;
    C_ = C_em_;
    mirror_test_.clear();
    bending_.setOnes();
    map_.set_bending(bending_);
  } else if (verdict == ImageVerdict::kShowsTube) {
    views.trust(observation);
  }
  return verdict;
}

// Where no coil holds the tip the shape goes straight on, and is soon further off the tube than lines reach:
// it is followed from the first coil outward, a piece at a time. What led it there may bend it.
void SingleFrameSolver::trace_tip(const Observation& observation, const CoilObservations& coils,
                                  TubeViews& views, TubeEstimate& estimate) {
  if (coils.hold_tip() || rest_ != nullptr) {
    return;
  }
  const double loose_mm = coils.first_used_mm();
  bool led = false;
  trace_loose_tip(loose_mm, [&](double from_mm) {
    if (!views.measure(observation, map_.spline(), C_,
                       {.reach_px = first_reach_px(), .tip_is_held = false, .from_mm = from_mm}, estimate)) {
      return false;
    }
    const auto lines = views.constraints(observation, 1, true);
    if (!lines.empty()) {
      led = true;
      estimate.iterations += static_cast<std::uint32_t>(
          map_.refine(coils, lines, nullptr, settings_.iterations, C_, converged_));
    }
    return true;
  });
  if (led) {
    soften_loose_tip(loose_mm, map_.spline().length_mm(), bending_);
    map_.set_bending(bending_);
  }
}

// The same of a long piece beyond the last coil, as far as it is in view. It is as stiff as elsewhere: it
// bends as the vessel around it does, and no more.
void SingleFrameSolver::trace_tail(const Observation& observation, const CoilObservations& coils,
                                   TubeViews& views, TubeEstimate& estimate) {
  constexpr double kPiece_mm = 16;
  const double length_mm = map_.spline().length_mm();
  double to_mm = coils.last_used_mm();
  bool is_in_view = length_mm - to_mm > CoilObservations::kHolds_mm;
  while (is_in_view && to_mm < length_mm) {
    to_mm += kPiece_mm;
    if (!views.measure(observation, map_.spline(), C_, {.reach_px = first_reach_px(), .to_mm = to_mm},
                       estimate)) {
      return;
    }
    const auto lines = views.constraints(observation, 1, true);
    is_in_view = std::ranges::any_of(
        lines, [to_mm](const ViewConstraints& view) { return view.shows(to_mm - kPiece_mm / 2); });
    if (is_in_view) {
      estimate.iterations += static_cast<std::uint32_t>(
          map_.refine(coils, lines, nullptr, settings_.iterations, C_, converged_));
    }
  }
}

int SingleFrameSolver::first_reach_px() const {
  return std::clamp(static_cast<int>(settings_.image_search_px), 3, LineSearch::kMaxReach);
}

bool SingleFrameSolver::has_loose_tip(const CoilObservations& coils) const {
  return loose_tip_mm(coils, rest_) > 0;
}

// What two views show costs too much on the other side.
void SingleFrameSolver::test_mirrored(const Observation& observation, const CoilObservations& coils,
                                      TubeViews& views, TubeEstimate& estimate) {
  const auto lines = views.constraints(observation, 1, false);
  const ViewConstraints* const view = view_of_tip(lines);
  const double loose_mm = loose_tip_mm(coils, rest_);
  if (loose_mm == 0 || view == nullptr) {
    return;
  }
  mirror_test_.run(
      {*view->camera, map_.spline(), loose_mm, map_.cost(), show_tip_from_two_sides(lines, loose_mm)}, C_,
      [&](Eigen::Matrix3Xd& C) {
        bool converged = false;
        estimate.iterations += static_cast<std::uint32_t>(
            map_.refine(coils, lines, nullptr, settings_.iterations, C, converged));
        return map_.cost();
      });
}

// chi^2 a coil that the lines cost.
double SingleFrameSolver::pull_on(const CoilObservations& coils, double coil_cost_before) {
  return (map_.contradiction(coils, C_) - coil_cost_before) / std::max(coils.used_count(), 1);
}

// Two witnesses against an image: its own lines, and the coils, which the true tube's image pulls by their
// noise only.
ImageVerdict SingleFrameSolver::judge_images(const CoilObservations& coils, double coil_cost_before,
                                             bool may_be_chance, const TubeEstimate& estimate) {
  if (estimate.in_view_ratio <= 0) {
    return ImageVerdict::kNone;
  }
  const auto agreeing = static_cast<double>(estimate.image_inlier_ratio);
  const double pull = pull_on(coils, coil_cost_before);
  if (may_be_chance || agreeing < kMinAgreeing ||
      (agreeing < kDoubtfulAgreeing && pull > kDoubtfulPullOfCoil)) {
    return ImageVerdict::kLost;
  }
  return pull > kMaxPull ? ImageVerdict::kContradicts : ImageVerdict::kShowsTube;
}

bool SingleFrameSolver::invert(const Observation& observation, const CoilObservations& coils,
                               TubeViews& views) {
  return map_.invert_at(coils, views.constraints(observation, 1, false), nullptr, C_);
}

}  // namespace tubed
