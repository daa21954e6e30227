#include "daemon/estimator/tip/hook_search.hpp"
#include "daemon/estimator/strain_slack.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tubed {

namespace {

constexpr std::array<int, 2> kSearchReaches_px = {14, 6};
constexpr int kCoilIterations = 5;
constexpr int kLineIterations = 4;
// Operators bend tips as well, and vessels do: what a wire or a wall makes of the last piece, a quarter
// circle or so, is no hook. Of the variance of its curvature.
constexpr double kBendable_mm = 50;
constexpr double kBendableBySo = 6;
constexpr float kShowsTube = 0.5F;  // share of lines that agree

}  // namespace

HookSearch::Part HookSearch::last_part(EstimatorSettings settings, InstrumentDescription instrument,
                                       double hook_mm) {
  const UniformCubicBSpline whole(settings.coefficient_count, instrument.length_mm);
  const std::size_t coils = std::min(kCoils, instrument.coils.size());
  const double last_coil_mm = coils > 0 ? instrument.coils[coils - 1].offset_from_tip_mm : 0;
  const double wanted_mm = std::max(hook_mm + kBeforeHook_mm, last_coil_mm + whole.spacing_mm());
  const int segments =
      std::min(static_cast<int>(std::ceil(wanted_mm / whole.spacing_mm())), settings.coefficient_count - 3);
  settings.coefficient_count = segments + 3;
  instrument.length_mm = segments * whole.spacing_mm();
  std::erase_if(instrument.marks_mm, [&](double mark_mm) { return mark_mm > instrument.length_mm; });
  return {std::move(settings), std::move(instrument)};
}

HookSearch::HookSearch(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                       const RoomDescription& room, double hook_mm)
    : HookSearch(last_part(settings, instrument, hook_mm), room) {}

HookSearch::HookSearch(const Part& part, const RoomDescription& room)
    : map_(part.settings, part.instrument.length_mm),
      views_(part.settings, part.instrument, room),
      bending_(Eigen::VectorXd::Ones(map_.bending_node_count())),
      C_coils_(Eigen::Matrix3Xd::Zero(3, part.settings.coefficient_count)) {
  map_.set_strain_slack(kStrainSlack);
  map_.set_stiffness(part.instrument.stiffness_profile());
  straight_.C = hooked_.C = C_coils_;
}

// Behind the first `from_segment` of the spline's the tip may bend as tips do.
void HookSearch::soften_tip(int from_segment) {
  bending_.setOnes();
  const auto begin = static_cast<Eigen::Index>(2 * from_segment);
  const auto end =
      std::min(bending_.size(), static_cast<Eigen::Index>(2 * kBendable_mm / map_.spline().spacing_mm()));
  if (end > begin) bending_.segment(begin, end - begin).setConstant(kBendableBySo);
  map_.set_bending(bending_);
}

bool HookSearch::solve_straight(const Observation& observation, const CoilObservations& coils) {
  map_.set_rest(nullptr);
  soften_tip(0);
  views_.forget_lines();
  coils_ = coils;
  for (CoilObservation& coil : coils_.coils) {
    if (coil.s_mm > length_mm()) coil.state = CoilState::kMissing;
  }
  bool converged = false;
  if (!map_.solve_linear(coils_, straight_.C)) {
    return false;
  }
  map_.refine(coils_, {}, nullptr, kCoilIterations, straight_.C, converged);
  straight_.cost_of_coils = map_.cost();
  C_coils_ = straight_.C;
  look(observation, straight_);
  return agreeing_ >= kShowsTube;
}

// For a binormal that is held the shape of the coils needs no guess.
double HookSearch::solve_with(RestHook& hook, int start, const Observation& observation) {
  map_.set_rest(&hook);
  soften_tip(hook.segment_count());
  const CubicBasis& basis = hook.beginning();
  const Eigen::Vector3d tangent = combine(C_coils_, basis.first, basis.first_derivative).normalized();
  const Eigen::Vector3d aside = tangent.unitOrthogonal();
  const double roll_rad = 2 * std::numbers::pi * start / kStarts;
  hook.set_binormal(std::cos(roll_rad) * aside + std::sin(roll_rad) * tangent.cross(aside));
  bool converged = false;
  map_.solve_linear(coils_, hooked_.C);
  map_.refine(coils_, {}, nullptr, kCoilIterations, hooked_.C, converged);
  hooked_.cost_of_coils = map_.cost();
  look(observation, hooked_);
  map_.set_rest(nullptr);
  return hooked_.cost;
}

double HookSearch::between_tips_mm() const {
  const CubicBasis tip = map_.spline().basis(0);
  return combine(hooked_.C - straight_.C, tip.first, tip.value).norm();
}

// Where the hypothesis has the tube in the images, twice, nearer each time.
void HookSearch::look(const Observation& observation, Hypothesis& hypothesis) {
  bool converged = false;
  for (const int reach_px : kSearchReaches_px) {
    views_.measure(observation, map_.spline(), hypothesis.C, {reach_px, false}, figures_);
    map_.refine(coils_, views_.constraints(observation, 1, true), nullptr, kLineIterations, hypothesis.C,
                converged);
  }
  agreeing_ = figures_.image_inlier_ratio;
  hypothesis.cost = map_.cost() + kUnseenCost * views_.unseen_at_tip(observation.instant);
}

}  // namespace tubed
