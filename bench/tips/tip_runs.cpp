#include "bench/tips/tip_runs.hpp"

#include <ctime>

#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/true_run.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

Sequence sequence_of(const SimulatedRun& run, const Scenario& scenario, const fs::path& folder,
                     const std::string& name) {
  if (!fs::exists(folder / name)) {
    const fs::path unfinished = folder / (name + ".unfinished");
    fs::remove_all(unfinished);
    fs::create_directories(folder);
    write_simulated_run(run, scenario, unfinished);
    fs::rename(unfinished, folder / name);
  }
  return read_sequence(folder / name);
}

void tell(ToldTip told, const Hook& hook, InstrumentDescription& instrument) {
  switch (told) {
    case ToldTip::kNothing:
      instrument.rest_shape = RestShape::kUnknown;
      return;
    case ToldTip::kStraight:
      instrument.rest_shape = RestShape::kStraight;
      return;
    case ToldTip::kAsItIs:
      instrument.rest_shape = hook.is_there() ? RestShape::kArcs : RestShape::kStraight;
      instrument.rest_arcs_mm.clear();
      for (const RestArc& arc : hook.curve.arcs) {
        instrument.rest_arcs_mm.insert(instrument.rest_arcs_mm.end(), {arc.length_mm, arc.radius_mm});
      }
      return;
    case ToldTip::kHook:
      instrument.rest_shape = RestShape::kHook;
      instrument.hook_radius_mm = 8;
      instrument.hook_length_mm = 14;
      return;
  }
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::vector<double> em_alone_mm(const Sequence& sequence, const TrueRun& truth,
                                const ShapeErrorSettings& judged) {
  EstimatorSettings settings;
  settings.mode = EstimatorMode::kEm;
  Estimates estimates;
  reconstruct(sequence, settings, FrangiSettings{},
              [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
                estimates.emplace(instant.frame, shape_of(estimate));
              });
  return evaluate_method(truth, estimates, judged).values_mm(kMetrics[1]);
}

SimulatedRun run_of(const TipCase& simulated, std::int64_t seed, int every) {
  return {.preset = simulated.preset,
          .seed = seed,
          .hook_radius_mm = simulated.hook_arcs_mm.empty() ? simulated.hook_radius_mm : 0,
          .hook_arcs_mm = simulated.hook_arcs_mm,
          .tip_coil_mm = simulated.tip_coil_mm,
          .every = every,
          .second_view_every = simulated.second_view_every};
}

}  // namespace

void check_tip(const TipCase& simulated, std::int64_t seed) { (void)scenario_of(run_of(simulated, seed, 1)); }

TipOutcome run_tip(const TipCase& simulated, ToldTip told, std::int64_t seed, int every,
                   const fs::path& folder) {
  const SimulatedRun run = run_of(simulated, seed, every);
  const Scenario scenario = scenario_of(run);
  std::string hook = std::to_string(simulated.hook_radius_mm);
  for (const double number : simulated.hook_arcs_mm) hook += "_" + std::to_string(number);
  const std::string name = simulated.preset + "-" + std::to_string(seed) + "-every-" + std::to_string(every) +
                           "-hook-" + hook + "-coil-" + std::to_string(simulated.tip_coil_mm) + "-second-" +
                           std::to_string(simulated.second_view_every);
  Sequence sequence = sequence_of(run, scenario, folder, name);
  tell(told, scenario.catheter.hook, sequence.room.instruments.front());
  EstimatorSettings settings;
  settings.mode = EstimatorMode::kFilter;
  Estimates estimates;
  std::map<std::uint32_t, std::pair<Validity, Reasons>> said;
  TipOutcome outcome;
  const double began_s = cpu_s();
  reconstruct(sequence, settings, FrangiSettings{},
              [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
                estimates.emplace(instant.frame, shape_of(estimate));
                said.emplace(instant.frame, std::pair(estimate.validity, estimate.reasons));
              });
  outcome.cpu_s = cpu_s() - began_s;
  ShapeErrorSettings judged;
  judged.part = JudgedPart::kInView;
  const TrueRun truth = true_run_of(sequence);
  const MethodEvaluation in_view = evaluate_method(truth, estimates, judged);
  for (std::size_t i = 0; i < truth.instants.size(); ++i) {
    if (!in_view.errors[i] || !in_view.tip_sigmas[i]) continue;
    const TrueInstant& instant = truth.instants[i];
    const Eigen::Vector3d tip = instant.truth.p_world_mm.col(0);
    const auto at = truth.cameras.front().project(tip);
    if (!at || !truth.cameras.front().contains(at->p_image_px)) continue;
    outcome.rms_in_view_mm.push_back(in_view.errors[i]->rms_mm);
    outcome.tip_mm.push_back((estimates.at(instant.frame).centreline.p_world_mm.col(0) - tip).norm());
    const bool is_valid = said.at(instant.frame).first == Validity::kValid;
    const bool is_beyond = *in_view.tip_sigmas[i] > 3;
    outcome.valid += is_valid ? 1 : 0;
    outcome.beyond_3_sigma += is_beyond ? 1 : 0;
    outcome.valid_beyond_3_sigma += is_valid && is_beyond ? 1 : 0;
    outcome.valid_beyond_3_sigma_and_mm += is_valid && is_beyond && outcome.tip_mm.back() > 3 ? 1 : 0;
    for (int bit = 0; bit < kReasonCount; ++bit) {
      const auto reason = static_cast<Reason>(1U << bit);
      if (said.at(instant.frame).second.has(reason)) ++outcome.reasons[std::string(name_of(reason))];
    }
  }
  outcome.em_rms_in_view_mm = em_alone_mm(sequence, truth, judged);
  return outcome;
}

}  // namespace tubed
