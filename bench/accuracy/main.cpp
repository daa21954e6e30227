// How accurate: every mode over sequence folders and simulated presets, the paper's Table 1 beside it.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "bench/accuracy/accuracy_report.hpp"
#include "bench/accuracy/bench_report.hpp"
#include "bench/accuracy/sensitivity.hpp"
#include "bench/accuracy/settings_by_name.hpp"
#include "bench/support/machine.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/simulated_run.hpp"
#include "idl/command_line/command_line.hpp"

namespace {

using namespace tubed;
namespace fs = std::filesystem;

struct Arguments {
  std::vector<std::string> sequences;
  std::vector<std::string> presets;
  std::vector<int> seeds;
  std::vector<std::string> modes;
  std::vector<std::string> options;
  int every = 1;
  double rate_hz = 0;
  std::string out = "accuracy";
  ShapeErrorSettings judged{.s_max_mm = 0};  ///< 0: not said
  std::string match = "nearest";
  bool sensitivity = false;
  std::string study;  ///< the one that is wanted; empty: all
  bool in_view_tables = false;

  /// The paper's second experiment has a study of its own.
  [[nodiscard]] bool is_bench() const { return presets == std::vector<std::string>{kBenchPreset}; }

  /// What was not said, as the study has it.
  void complete() {
    if (sequences.empty() && presets.empty()) presets = {"paper"};
    constexpr int kFirstSeed = 1001;
    constexpr std::size_t kRuns = 3;
    constexpr std::size_t kDraws = 20;
    if (seeds.empty()) {
      seeds.resize(is_bench() ? kDraws : kRuns);
      std::iota(seeds.begin(), seeds.end(), kFirstSeed);
    }
    if (modes.empty()) modes = is_bench() ? std::vector<std::string>{"em", "paper", "filter"} : mode_names();
    if (judged.s_max_mm == 0)
      judged.s_max_mm = is_bench() ? kBenchLastCoil_mm : ShapeErrorSettings{}.s_max_mm;
  }
};

/// One line on a terminal, rewritten.
void show_progress(const std::string& words, bool done) {
  static const bool live = isatty(STDERR_FILENO) == 1;
  if (live) std::cerr << "\r\033[K" << words << (done ? "\n" : "") << std::flush;
  if (!live && done) std::cerr << words << '\n';
}

void write_file(const fs::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

/// The folder of a preset's run, simulated unless it is there already.
fs::path simulated(const std::string& preset, int seed, const Arguments& arguments) {
  const fs::path folder =
      fs::path(arguments.out) / "sequences" /
      (preset + "-" + std::to_string(seed) +
       (arguments.rate_hz > 0 ? "-" + std::to_string(std::lround(arguments.rate_hz)) + "hz" : ""));
  if (fs::exists(folder / "truth.csv")) return folder;
  fs::create_directories(folder.parent_path());
  const SimulatedRun run{
      .preset = preset, .seed = seed, .every = arguments.every, .rate_hz = arguments.rate_hz};
  write_simulated_run(run, scenario_of(run), folder, [&](std::size_t done, std::size_t total) {
    if (done % 10 == 0 || done == total) {
      show_progress(
          folder.filename().string() + ": exposure " + std::to_string(done) + " of " + std::to_string(total),
          done == total);
    }
  });
  return folder;
}

std::vector<fs::path> folders_of(const Arguments& arguments) {
  std::vector<fs::path> folders(arguments.sequences.begin(), arguments.sequences.end());
  for (const std::string& preset : arguments.presets) {
    for (const int seed : arguments.seeds) folders.push_back(simulated(preset, seed, arguments));
  }
  return folders;
}

SequenceResult run_sequence(const Sequence& sequence, const std::string& name,
                            const std::vector<Method>& methods, const Arguments& arguments,
                            const fs::path& out) {
  SequenceResult result{name, methods, {}, instants_of(sequence).size(), arguments.judged};
  for (const Method& method : methods) {
    result.runs.push_back(run_method(
        sequence, method, arguments.judged, out / (method.name + ".csv"), [&](auto done, auto total) {
          if (done % 10 == 0 || done == total) {
            show_progress(
                name + ": " + method.name + ' ' + std::to_string(done) + " of " + std::to_string(total),
                done == total);
          }
        }));
  }
  return result;
}

void draw(const Sequence& sequence, const SequenceResult& result, const fs::path& out) {
  std::vector<BoxPair> boxes;
  for (const ComparedPair& pair : pairs_among(result.methods)) {
    boxes.push_back({result.methods[pair.em].name, result.methods[pair.fused].name, &result.runs[pair.em].all,
                     &result.runs[pair.fused].all});
  }
  if (!boxes.empty()) write_file(out / "boxes.svg", box_plots(result.name + ": errors, all points", boxes));
  std::vector<double> t_s;
  for (const SequenceInstant& instant : instants_of(sequence)) t_s.push_back(instant.t_s);
  std::vector<ErrorCurve> curves;
  for (std::size_t i = 0; i < result.methods.size(); ++i) {
    curves.push_back({result.methods[i].name, &result.runs[i].in_view});
  }
  write_file(out / "errors.svg", error_over_time(result.name + ": errors of points in view", t_s, curves));
}

int run_bench(const Arguments& arguments, const std::vector<Method>& methods, const std::string& command) {
  std::vector<BenchDraw> draws;
  for (const int seed : arguments.seeds) {
    const fs::path folder = fs::path(arguments.out) / "sequences" / ("bench-" + std::to_string(seed));
    draws.push_back(run_bench_draw(seed, folder, methods, arguments.judged,
                                   [](const std::string& words) { show_progress(words, false); }));
    show_progress("bench-" + std::to_string(seed) + ": done", true);
  }
  print_bench(draws, methods, std::cout);
  const fs::path json = fs::path(arguments.out) / "bench.json";
  write_file(json, whole_report(command, bench_rows(draws, methods), nlohmann::json::array()).dump(1) + "\n");
  std::cout << "figures: " << json.string() << '\n';
  return 0;
}

int run(Arguments arguments, const std::string& command) {
  arguments.judged.match = arguments.match == "arc" ? PointMatch::kArcLength : PointMatch::kNearest;
  EstimatorSettings settings;
  for (const std::string& option : arguments.options) apply_option(option, settings);
  const std::vector<Method> methods = methods_of(arguments.modes, settings);
  if (arguments.is_bench()) return run_bench(arguments, methods, command);
  nlohmann::json rows = nlohmann::json::array();
  nlohmann::json comparisons = nlohmann::json::array();
  for (const fs::path& folder : folders_of(arguments)) {
    const Sequence sequence = read_sequence(folder);
    if (sequence.truth.empty()) throw std::runtime_error(folder.string() + ": has no truth.csv to judge by");
    const std::string name = fs::weakly_canonical(folder).filename().string();
    const fs::path out = fs::path(arguments.out) / name;
    fs::create_directories(out);
    const SequenceResult result = run_sequence(sequence, name, methods, arguments, out);
    print_methods(result, std::cout);
    for (const ComparedPair& pair : pairs_among(methods)) {
      print_pair(result, pair, arguments.in_view_tables ? JudgedPart::kInView : JudgedPart::kAll, std::cout);
    }
    draw(sequence, result, out);
    const nlohmann::json judged = rows_of(result);
    rows.insert(rows.end(), judged.begin(), judged.end());
    const nlohmann::json compared = comparisons_of(result);
    comparisons.insert(comparisons.end(), compared.begin(), compared.end());
    if (arguments.sensitivity) {
      const auto panels =
          study_sensitivity(sequence, methods, arguments.judged, arguments.study, out / "sensitivity.csv",
                            [](const std::string& words) { show_progress(words, true); });
      write_file(out / "sensitivity.svg",
                 sensitivity_plots(name + ": points in view, coils measured again from the truth", panels));
      const nlohmann::json varied = rows_of(name, panels);
      rows.insert(rows.end(), varied.begin(), varied.end());
    }
  }
  const fs::path json = fs::path(arguments.out) / "accuracy.json";
  write_file(json, whole_report(command, rows, comparisons).dump(1) + "\n");
  std::cout << "figures: " << json.string() << "; plots: " << arguments.out << "/*/{boxes,errors}.svg\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Program program("Errors of every mode over sequences with truth, beside the paper's Table 1",
                  "accuracy_bench");
  CommandLine app = program.command_line();
  Arguments arguments;
  app.add_option("SEQUENCE", arguments.sequences, "sequence folders with truth.csv");
  app.add_option(
         "--preset", arguments.presets,
         "presets to simulate too: those of `tubectl simulate`; bench alone is the paper's second experiment")
      .delimiter(',');
  app.add_option("--seeds", arguments.seeds,
                 "of the presets, one run each; 1001,1002,1003, of bench 1001 to 1020")
      .delimiter(',');
  app.add_option("--every", arguments.every, "of the presets: every so many steps").capture_default_str();
  app.add_option("--rate", arguments.rate_hz,
                 "of the presets: exposures a second, Hz; as the preset has it, mostly 7.5")
      .in_range(0.5, 60.0);
  app.add_option("--modes", arguments.modes, "modes to compare; all, of bench em,paper,filter")
      .delimiter(',');
  app.add_option("--set", arguments.options,
                 "a setting of the estimator, KEY=VALUE; --list-settings names them");
  app.add_option("--s-max", arguments.judged.s_max_mm,
                 "judge from the tip up to this arc length, mm; the last coil's, 370, of bench 274");
  app.add_option("--match", arguments.match, "partner of a true point")
      .is_member({"nearest", "arc"})
      .capture_default_str();
  app.add_flag("--in-view", arguments.in_view_tables,
               "Table 1 over the points inside the image instead of all");
  app.add_flag("--sensitivity", arguments.sensitivity,
               "vary coils, noise, registration, rate, views, coefficients");
  app.add_option("--study", arguments.study, "of --sensitivity: those whose title contains this text only");
  app.add_option("--out", arguments.out, "folder for estimates, plots and JSON").capture_default_str();
  bool lists_settings = false;
  app.add_flag("--list-settings", lists_settings, "print the settings that --set knows");
  if (const auto ended = program.parse(argc, argv)) return *ended;
  if (lists_settings) {
    std::cout << settings_help();
    return 0;
  }
  arguments.complete();
  try {
    return run(arguments, command_line("accuracy", argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "accuracy_bench: " << error.what() << '\n';
    return 1;
  }
}
