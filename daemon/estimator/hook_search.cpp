#include "daemon/estimator/hook_search.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/estimator/mirror_test.hpp"

namespace tubed {

namespace {

constexpr std::array<int, 2> kReaches_px = {14, 6};
constexpr int kCoilIterations = 5;
constexpr int kLineIterations = 4;
// Operators bend tips as well, and vessels do: what a wire or a wall makes of the last piece, a quarter
// circle or so, is no hook. Of the variance of its curvature.
constexpr double kBendable_mm = 50;
constexpr double kBendableBySo = 6;
constexpr double kHopeless = 25;        // chi^2 of the coils above the best start: no image makes up for it
constexpr float kShowsTube = 0.5F;      // share of lines that agree
constexpr double kStrainSlack = 4.5;    // as in RecursiveEstimator
constexpr double kMirroredFrom_mm = 2;  // behind the hook

}  // namespace

HookSearch::HookSearch(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                       const RoomDescription& room)
    : settings_(settings),
      map_(settings, instrument.length_mm),
      views_(settings, instrument, room),
      bending_(Eigen::VectorXd::Ones(map_.bending_node_count())),
      C_coils_(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)) {
  map_.set_strain_slack(kStrainSlack);
  straight_.C = mirrored_.C = C_coils_;
  for (Hypothesis& start : starts_) {
    start.C = C_coils_;
  }
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
  bool converged = false;
  if (!map_.solve_linear(coils, straight_.C)) {
    return false;
  }
  map_.refine(coils, {}, nullptr, kCoilIterations, straight_.C, converged);
  C_coils_ = straight_.C;
  look(observation, coils, straight_);
  return agreeing_ >= kShowsTube;
}

double HookSearch::solve_with(RestHook& hook, const Observation& observation, const CoilObservations& coils) {
  map_.set_rest(&hook);
  soften_tip(hook.segment_count());
  start_everywhere(hook, coils);
  double least = starts_[0].cost;
  for (const Hypothesis& start : starts_) {
    least = std::min(least, start.cost);
  }
  Hypothesis* best = nullptr;
  for (Hypothesis& start : starts_) {
    if (start.cost > least + kHopeless) {
      continue;
    }
    hook.set_binormal(start.binormal);
    look(observation, coils, start);
    start.binormal = hook.binormal();
    best = best == nullptr || start.cost < best->cost ? &start : best;
  }
  try_mirrored(hook, observation, coils, *best);
  hook.set_binormal(best->binormal);
  map_.set_rest(nullptr);
  return best->cost;
}

// For a binormal that is held the shape of the coils needs no guess.
void HookSearch::start_everywhere(RestHook& hook, const CoilObservations& coils) {
  const CubicBasis& basis = hook.beginning();
  const Eigen::Vector3d tangent = combine(C_coils_, basis.first, basis.first_derivative).normalized();
  const Eigen::Vector3d aside = tangent.unitOrthogonal();
  const Eigen::Vector3d beside = tangent.cross(aside);
  bool converged = false;
  for (int k = 0; k < kStarts; ++k) {
    const double roll_rad = 2 * std::numbers::pi * k / kStarts;
    Hypothesis& start = starts_[static_cast<std::size_t>(k)];
    hook.set_binormal(std::cos(roll_rad) * aside + std::sin(roll_rad) * beside);
    map_.solve_linear(coils, start.C);
    map_.refine(coils, {}, nullptr, kCoilIterations, start.C, converged);
    start.binormal = hook.binormal();
    start.cost = map_.cost();
  }
}

// Where the hypothesis has the tube in the images, twice, nearer each time.
void HookSearch::look(const Observation& observation, const CoilObservations& coils, Hypothesis& hypothesis) {
  bool converged = false;
  for (const int reach_px : kReaches_px) {
    views_.measure(observation, map_.spline(), hypothesis.C, {reach_px, false}, figures_);
    map_.refine(coils, views_.constraints(observation, 1, true), nullptr, kLineIterations, hypothesis.C,
                converged);
  }
  agreeing_ = figures_.image_inlier_ratio;
  hypothesis.cost = map_.cost() + kUnseenCost * views_.unseen_at_tip(observation.instant);
}

// One view shows how steep a hook is, but not whether toward the camera or away from it.
void HookSearch::try_mirrored(RestHook& hook, const Observation& observation, const CoilObservations& coils,
                              Hypothesis& best) {
  const auto lines = views_.constraints(observation, 1, true);
  const ViewConstraints* const view = view_of_tip(lines);
  if (view == nullptr) {
    return;
  }
  const double turn_mm = hook.shape().length_mm + kMirroredFrom_mm;
  MirrorTest::mirror_before(turn_mm, {*view->camera, map_.spline(), turn_mm, best.cost}, best.C, mirrored_.C);
  hook.set_binormal(-best.binormal);  // the fit takes it to where the mirrored shape has it
  look(observation, coils, mirrored_);
  mirrored_.binormal = hook.binormal();
  if (mirrored_.cost < best.cost) {
    std::swap(mirrored_, best);
  }
}

}  // namespace tubed
