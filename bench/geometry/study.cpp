#include "bench/geometry/study.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "drivers/laboratory/room_mistakes.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

/// "5" of "pan=5"; nothing for another name. Throws std::invalid_argument for what is no number.
std::optional<double> value_of(const std::string& mistake, const std::string& name) {
  if (!mistake.starts_with(name + "=")) return std::nullopt;
  double value = 0;
  const char* const end = mistake.data() + mistake.size();
  const auto [stopped, error] = std::from_chars(mistake.data() + name.size() + 1, end, value);
  if (error != std::errc{} || stopped != end) {
    throw std::invalid_argument("mistake \"" + mistake + "\": expected " + name + "= and a number");
  }
  return value;
}

/// When it begins, s.
double begins_s(const SimulatedRun& run, const Scenario& scenario) {
  const RoomMistakes mistakes = parse_mistakes(run.mistakes);
  const bool is_move = run.pan_mm != 0 || run.turn_deg != 0 || run.zoom != 1;
  if (mistakes.field_jump_mm > 0) return mistakes.field_jump_s.value_or(scenario.duration_s() / 2);
  return is_move ? scenario.duration_s() / 2 : 0;
}

/// Whatever is simulated or replayed says so: no news.
Reasons without_origin(Reasons reasons) {
  const auto origin =
      static_cast<std::uint32_t>(Reason::kDemoData) | static_cast<std::uint32_t>(Reason::kReplayData);
  return Reasons(reasons.bits() & ~origin);
}

bool is_doubted(Validity validity) {
  return validity == Validity::kQuestionable || validity == Validity::kInvalid;
}

}  // namespace

SimulatedRun run_with(const std::string& mistake, const std::string& preset, std::int64_t seed) {
  SimulatedRun run{.preset = preset, .seed = seed, .announces_pose = false};
  const auto pan_mm = value_of(mistake, "pan");
  const auto turn_deg = value_of(mistake, "turn");
  const auto zoom = value_of(mistake, "zoom");
  run.pan_mm = pan_mm.value_or(0);
  run.turn_deg = turn_deg.value_or(0);
  run.zoom = zoom.value_or(1);
  if (mistake != "none" && !pan_mm && !turn_deg && !zoom) run.mistakes = {mistake};
  (void)parse_mistakes(run.mistakes);
  return run;
}

std::vector<double> tip_errors_mm(const TrueRun& run, const Estimates& estimates,
                                  const MethodEvaluation& judged) {
  std::vector<double> errors_mm;
  for (std::size_t i = 0; i < run.instants.size(); ++i) {
    if (!judged.errors[i]) continue;
    const SampledCentreline& estimate = estimates.at(run.instants[i].frame).centreline;
    errors_mm.push_back((estimate.p_world_mm.col(0) - run.instants[i].truth.p_world_mm.col(0)).norm());
  }
  return errors_mm;
}

MistakeRuns::MistakeRuns(std::string preset, std::int64_t seed, int every, fs::path folder)
    : preset_(std::move(preset)), seed_(seed), every_(every), folder_(std::move(folder)) {
  mechanics_ = shared_run_of(make_scenario(preset_, seed_));
}

Sequence MistakeRuns::sequence_of(const SimulatedRun& run, const Scenario& scenario) {
  SimulatedRun pictures = run;
  if (!changes_pictures(run)) pictures.mistakes.clear();
  std::string name = preset_ + "-" + std::to_string(seed_) + "-every-" + std::to_string(every_);
  if (run.pan_mm != 0) name += "-pan-" + std::to_string(run.pan_mm);
  if (run.turn_deg != 0) name += "-turn-" + std::to_string(run.turn_deg);
  if (run.zoom != 1) name += "-zoom-" + std::to_string(run.zoom);
  for (const std::string& word : pictures.mistakes) name += "-" + word;
  if (!fs::exists(folder_ / name)) {
    const fs::path unfinished = folder_ / (name + ".unfinished");
    fs::remove_all(unfinished);
    fs::create_directories(folder_);
    write_simulated_run(pictures, scenario_of(pictures), unfinished);
    fs::rename(unfinished, folder_ / name);
  }
  Sequence sequence = read_sequence(folder_ / name);
  return pictures.mistakes == run.mistakes ? sequence : with_mistakes(std::move(sequence), run, scenario);
}

MistakeRuns::Outcome MistakeRuns::judge(const std::string& mistake) {
  SimulatedRun run = run_with(mistake, preset_, seed_);
  run.every = every_;
  const Scenario scenario = scenario_of(run);
  const Sequence sequence = sequence_of(run, scenario);
  EstimatorSettings settings;
  settings.mode = EstimatorMode::kFilter;
  Outcome outcome;
  Estimates estimates;
  reconstruct(
      sequence, settings, FrangiSettings{},
      [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
        estimates.emplace(instant.frame, shape_of(estimate));
        outcome.instants.push_back({instant.t_s, sequence.frames[instant.rows.front()].fluoroscopy_on(),
                                    estimate.validity, without_origin(estimate.reasons)});
      });
  ShapeErrorSettings judged;
  judged.part = JudgedPart::kInView;
  const TrueRun truth = true_run_of(run, scenario, sequence);
  outcome.in_view = evaluate_method(truth, estimates, judged);
  outcome.tip_mm = tip_errors_mm(truth, estimates, outcome.in_view);
  const auto first = std::find_if(outcome.instants.begin(), outcome.instants.end(),
                                  [](const Instant& instant) { return instant.has_image; });
  outcome.began_s = std::max(begins_s(run, scenario), first == outcome.instants.end() ? 0 : first->t_s);
  return outcome;
}

Said said_of(const MistakeRuns::Outcome& mistaken, const MistakeRuns::Outcome& without) {
  Said said;
  for (std::size_t i = 0; i < mistaken.instants.size(); ++i) {
    const MistakeRuns::Instant& instant = mistaken.instants[i];
    const bool is_news = is_doubted(instant.validity) && without.instants[i].validity == Validity::kValid;
    if (!is_news || instant.t_s < mistaken.began_s) continue;
    if (!said.first_s) {
      said.first_s = instant.t_s - mistaken.began_s;
      said.first_reasons = instant.reasons;
    }
    ++said.instants;
    for (int bit = 0; bit < kReasonCount; ++bit) {
      const auto reason = static_cast<Reason>(1U << bit);
      if (instant.reasons.has(reason)) ++said.reasons[std::string(name_of(reason))];
    }
  }
  return said;
}

}  // namespace tubed
