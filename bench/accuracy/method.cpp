#include "bench/accuracy/method.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <stdexcept>

#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/true_run.hpp"

namespace tubed {

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

Sequence with_fluoroscopy_off(Sequence sequence) {
  for (SequenceFrame& frame : sequence.frames) frame.file.clear();
  return sequence;
}

std::optional<std::size_t> index_of(const std::vector<Method>& methods, std::string_view name) {
  const auto found =
      std::find_if(methods.begin(), methods.end(), [&](const Method& method) { return method.name == name; });
  if (found == methods.end()) return std::nullopt;
  return static_cast<std::size_t>(found - methods.begin());
}

}  // namespace

std::vector<Method> methods_of(const std::vector<std::string>& modes, const EstimatorSettings& settings) {
  std::vector<Method> methods;
  for (const std::string& word : modes) {
    const auto mode = mode_named(word);
    if (!mode) throw std::invalid_argument("there is no mode \"" + word + "\"");
    Method method{word, settings};
    method.settings.mode = *mode;
    const std::string em_alone(row_of(*mode).em_alone);
    if (!em_alone.empty() && !mode_named(em_alone)) {
      methods.push_back({em_alone, method.settings, true});
    }
    methods.push_back(method);
  }
  return methods;
}

std::vector<ComparedPair> pairs_among(const std::vector<Method>& methods) {
  std::vector<ComparedPair> pairs;
  const auto compare = [&](std::string_view em, std::string_view fused) {
    const auto first = index_of(methods, em);
    const auto second = index_of(methods, fused);
    if (first && second) pairs.push_back({*first, *second});
  };
  for (const EstimatorModeRow& row : kEstimatorModes) compare(row.em_alone, row.name);
  compare(name_of(EstimatorMode::kPaper), name_of(EstimatorMode::kFilter));
  return pairs;
}

Sequence as_given(const Sequence& sequence, const Method& method) {
  return method.images_withheld ? with_fluoroscopy_off(sequence) : sequence;
}

MethodRun run_method(const Sequence& sequence, const Method& method, const ShapeErrorSettings& judged,
                     const std::filesystem::path& csv, const OnInstant& on_instant) {
  const Sequence given = as_given(sequence, method);
  const std::size_t total = instants_of(given).size();
  std::ofstream out(csv);
  write_estimate_header(out);
  MethodRun run;
  Clock::time_point start = Clock::now();
  reconstruct(given, method.settings, FrangiSettings{},
              [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
                run.solve_ms.push_back(milliseconds_since(start));
                write_estimate_rows(out, instant.frame, estimate);
                on_instant(run.solve_ms.size(), total);
                start = Clock::now();
              });
  if (!out.flush()) throw std::runtime_error(csv.string() + ": cannot be written");
  out.close();
  const TrueRun truth = true_run_of(sequence);
  const Estimates estimates = read_estimates(csv);
  ShapeErrorSettings settings = judged;
  settings.part = JudgedPart::kAll;
  run.all = evaluate_method(truth, estimates, settings);
  settings.part = JudgedPart::kInView;
  run.in_view = evaluate_method(truth, estimates, settings);
  return run;
}

}  // namespace tubed
