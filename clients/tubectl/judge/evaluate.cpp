// tubectl evaluate: estimates against the truth of a sequence folder.
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "clients/evaluation/evaluation_report.hpp"
#include "clients/evaluation/true_run.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct EvaluateArguments {
  std::string sequence;
  std::string em_file;
  std::string fused_file;
  std::string json_file;
  std::string match = "nearest";
  ShapeErrorSettings settings;
  bool in_view = false;
  std::string config;  ///< empty: the sequence's own cameras
};

std::optional<MethodEvaluation> evaluated(const TrueRun& run, const std::string& file,
                                          const ShapeErrorSettings& settings) {
  if (file.empty()) return std::nullopt;
  const Estimates estimates = read_estimates(file);
  try {
    return evaluate_method(run, estimates, settings);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file + ": " + error.what());
  }
}

EvaluationReport evaluate(const EvaluateArguments& arguments) {
  const TrueRun run = read_true_run(arguments.sequence, arguments.config);
  EvaluationReport report;
  report.sequence = arguments.sequence;
  report.due_count = run.instants.size();
  report.settings = arguments.settings;
  report.settings.match = arguments.match == "arc" ? PointMatch::kArcLength : PointMatch::kNearest;
  report.settings.part = arguments.in_view ? JudgedPart::kInView : JudgedPart::kAll;
  report.em = evaluated(run, arguments.em_file, report.settings);
  report.fused = evaluated(run, arguments.fused_file, report.settings);
  if (report.em && report.fused) report.comparison = compare(*report.em, *report.fused);
  return report;
}

bool anything_judged(const EvaluationReport& report) {
  return (!report.em || report.em->judged_count() > 0) && (!report.fused || report.fused->judged_count() > 0);
}

int run_evaluate(const EvaluateArguments& arguments) {
  const EvaluationReport report = evaluate(arguments);
  if (arguments.json_file == "-") {
    std::cout << to_json(report).dump(2) << '\n';
  } else {
    print_report(report, std::cout);
    if (!arguments.json_file.empty()) {
      std::ofstream file(arguments.json_file);
      file << to_json(report).dump(2) << '\n';
      if (!file.flush()) throw std::runtime_error(arguments.json_file + ": cannot be written");
    }
  }
  return anything_judged(report) ? kExitOk : kExitFailed;
}

}  // namespace

CommandLine add_evaluate(CommandLine app, int& exit_code) {
  CommandLine verb = app.add_subcommand(
      "evaluate", "Compare estimates with the truth of a sequence, as the paper's Table 1");
  const auto arguments = std::make_shared<EvaluateArguments>();
  verb.add_option("SEQUENCE", arguments->sequence, "Sequence folder with truth.csv").required();
  verb.add_option("--em", arguments->em_file, "Estimates from EM alone (CSV of tubectl reconstruct)");
  verb.add_option("--fused", arguments->fused_file, "Estimates from EM and images");
  verb.add_option("--match", arguments->match,
                  "Partner of a true point: the closest, or that of equal arc length")
      .is_member({"nearest", "arc"})
      .capture_default_str();
  verb.add_option("--s-max", arguments->settings.s_max_mm, "Judge from the tip up to this arc length, mm")
      .positive()
      .capture_default_str();
  verb.add_flag("--in-view", arguments->in_view,
                "Judge only the points inside the image of the frame's first camera");
  verb.add_option("--config", arguments->config,
                  "Take the cameras, which give errors their axes and their view, from this configuration");
  verb.add_option("--json", arguments->json_file,
                  "Write the figures to FILE too; - = to standard output instead");
  verb.callback([arguments, &exit_code] {
    if (arguments->em_file.empty() && arguments->fused_file.empty()) {
      refuse_usage("evaluate", "give --em, --fused or both");
    }
    exit_code = run_evaluate(*arguments);
  });
  return verb;
}

}  // namespace tubed
