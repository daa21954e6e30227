// geometry_bench: does an estimate say so when room and description do not fit? Each mistake in simulated
// runs with truth: how far off, how sure, and how soon it is said.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/geometry/pooled_runs.hpp"
#include "bench/geometry/sensitivity_table.hpp"
#include "bench/geometry/study.hpp"
#include "bench/support/machine.hpp"
#include "bench/support/report.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {
namespace {

struct Arguments {
  std::vector<std::string> presets;
  std::vector<int> seeds{51, 52, 53};
  std::vector<std::string> mistakes;
  int every = 0;
  int threads = 2;
  std::string out = "geometry";
  bool sensitivity = false;

  /// What was not said, as the study has it.
  void complete() {
    if (presets.empty()) {
      presets = sensitivity ? std::vector<std::string>{"field"}
                            : std::vector<std::string>{"clinical", "field", "paper"};
    }
    if (mistakes.empty()) {
      mistakes = sensitivity
                     ? operator_errors()
                     : std::vector<std::string>{"none",       "registration=6,2", "pose=5,1",  "offsets=5",
                                                "focal=1.08", "focal=0.95",       "clock=150", "field-jump=4",
                                                "pan=5",      "turn=15"};
    }
    if (every == 0) every = sensitivity ? 3 : 1;
  }
};

std::string seconds_of(const std::vector<std::optional<double>>& first_s) {
  std::string text;
  for (const auto& first : first_s) {
    std::array<char, 16> word{};
    if (first) std::snprintf(word.data(), word.size(), "%.1f", *first);
    text += (text.empty() ? "" : " ") + std::string(first ? word.data() : "-");
  }
  return text;
}

/// "IMAGE_LOST_TUBE 80 %, COIL_OUTLIER 20 %": at which share of the instants that are doubted.
std::string reasons_of(const PooledRuns& line) {
  std::vector<std::pair<std::size_t, std::string>> sorted;
  for (const auto& [reason, count] : line.reasons) sorted.emplace_back(count, reason);
  std::sort(sorted.rbegin(), sorted.rend());
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(sorted.size(), 3); ++i) {
    std::array<char, 64> word{};
    std::snprintf(word.data(), word.size(), "%s %.0f %%", sorted[i].second.c_str(),
                  percent(sorted[i].first, line.doubted));
    text += (text.empty() ? "" : ", ") + std::string(word.data());
  }
  return text.empty() ? "-" : text;
}

constexpr const char* kHeading =
    "preset    mistake           in view  VALID %  RMS mm    p95  misleading %: VALID    all  within 1/2/3 "
    "sigma  "
    "first said, s, each seed  reasons of those instants";

std::string text_of(const std::string& preset, const std::string& mistake, const PooledRuns& line) {
  std::array<char, 512> text{};
  const bool any = !line.rms_mm.empty();
  const bool covered = line.coverage.coordinate_count > 0;
  const auto share = [&](std::size_t k) { return covered ? 100 * line.coverage.share(k) : 0; };
  std::snprintf(text.data(), text.size(),
                "%-9s %-17s %7zu  %7.1f  %6.2f %6.2f  %19.2f %6.2f  %5.1f %5.1f %5.1f   %-24s  %s",
                preset.c_str(), mistake.c_str(), line.rms_mm.size(), percent(line.valid, line.due),
                any ? percentile(line.rms_mm, 50) : 0, any ? percentile(line.rms_mm, 95) : 0,
                percent(line.of_valid.misleading, line.of_valid.instants),
                percent(line.of_all.misleading, line.of_all.instants), share(1), share(2), share(3),
                seconds_of(line.first_s).c_str(), reasons_of(line).c_str());
  return text.data();
}

nlohmann::json json_of(const std::string& preset, const std::string& mistake, const PooledRuns& line) {
  nlohmann::json first_s = nlohmann::json::array();
  for (const auto& first : line.first_s) {
    first_s.push_back(first ? nlohmann::json(*first) : nlohmann::json(nullptr));
  }
  nlohmann::json row{{"name", "geometry/" + preset + "/" + mistake},
                     {"unit", "mm"},
                     {"n", line.rms_mm.size()},
                     {"due", line.due},
                     {"valid", line.valid},
                     {"valid_in_view", line.of_valid.instants},
                     {"misleading_valid", line.of_valid.misleading},
                     {"judged", line.of_all.instants},
                     {"misleading", line.of_all.misleading},
                     {"first_said_s", first_s},
                     {"first_reasons", names_of(line.first_reasons)},
                     {"doubted", line.doubted},
                     {"reasons", line.reasons},
                     {"p50", nullptr},
                     {"p95", nullptr},
                     {"tip_p50", nullptr},
                     {"within_sigma", nullptr}};
  if (!line.tip_mm.empty()) row["tip_p50"] = percentile(line.tip_mm, 50);
  if (!line.rms_mm.empty()) {
    row["p50"] = percentile(line.rms_mm, 50);
    row["p95"] = percentile(line.rms_mm, 95);
  }
  if (line.coverage.coordinate_count > 0) {
    row["within_sigma"] = {line.coverage.share(1), line.coverage.share(2), line.coverage.share(3)};
  }
  return row;
}

/// All runs of one preset and seed, in the order of the mistakes; the one without comes first of all.
struct Task {
  std::string preset;
  int seed;
  std::vector<MistakeRuns::Outcome> outcomes;
  std::vector<Said> said;
};

void work(const Arguments& arguments, Task& task) {
  MistakeRuns runs(task.preset, task.seed, arguments.every, arguments.out);
  const MistakeRuns::Outcome without = runs.judge("none");
  for (const std::string& mistake : arguments.mistakes) {
    task.outcomes.push_back(mistake == "none" ? without : runs.judge(mistake));
    task.said.push_back(said_of(task.outcomes.back(), without));
    std::cerr << task.preset + " " + std::to_string(task.seed) + ": " + mistake + "\n";
  }
}

/// Throws what the first of them throws.
void work_all(const Arguments& arguments, std::vector<Task>& tasks) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr problem;
  std::mutex mutex;
  const auto take_tasks = [&] {
    for (std::size_t i = next++; i < tasks.size(); i = next++) {
      try {
        work(arguments, tasks[i]);
      } catch (...) {
        const std::lock_guard lock(mutex);
        problem = problem ? problem : std::current_exception();
        next = tasks.size();
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < arguments.threads; ++i) threads.emplace_back(take_tasks);
  }
  if (problem) std::rethrow_exception(problem);
}

void run(const Arguments& arguments, const std::string& command) {
  for (const std::string& mistake : arguments.mistakes) {
    for (const std::string& preset : arguments.presets) {
      (void)scenario_of(
          run_with(mistake, preset, arguments.seeds.front()));  // wrong words are refused at once
    }
  }
  std::vector<Task> tasks;
  for (const std::string& preset : arguments.presets) {
    for (const int seed : arguments.seeds) tasks.push_back({preset, seed, {}, {}});
  }
  work_all(arguments, tasks);
  nlohmann::json rows = nlohmann::json::array();
  std::cout << kHeading << '\n';
  std::string tables;
  for (const std::string& preset : arguments.presets) {
    std::vector<PooledRuns> lines;
    for (std::size_t i = 0; i < arguments.mistakes.size(); ++i) {
      PooledRuns& line = lines.emplace_back();
      for (const Task& task : tasks) {
        if (task.preset == preset) line.add(task.outcomes[i], task.said[i]);
      }
      std::cout << text_of(preset, arguments.mistakes[i], line) << '\n';
      rows.push_back(json_of(preset, arguments.mistakes[i], line));
    }
    if (arguments.sensitivity)
      tables += "\npreset " + preset + "\n\n" + sensitivity_table(arguments.mistakes, lines);
  }
  const Machine machine = this_machine();
  const nlohmann::json report{
      {"git", source_revision()},
      {"machine", {{"cpu", machine.cpu}, {"cores", machine.cores}, {"load", machine.load}}},
      {"command", command},
      {"rows", rows}};
  const std::string json = arguments.out + "/geometry.json";
  write_text(json, report.dump(1) + "\n");
  std::cout
      << tables
      << "misleading: a point in view off by more than 3 mm and by more than 3 sigma of that direction\n"
      << "wrote " << json << '\n';
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  using namespace tubed;
  Program program("Does an estimate say so when the room is not as it is described?", "geometry_bench");
  CommandLine app = program.command_line();
  Arguments arguments;
  app.add_flag(
      "--sensitivity", arguments.sensitivity,
      "how far each error of whoever sets a room up moves the shape: other mistakes, preset field and "
      "every third exposure unless told otherwise, and one table more");
  app.add_option("--presets", arguments.presets, "those of `tubectl simulate`; clinical,field,paper")
      .delimiter(',');
  app.add_option("--seeds", arguments.seeds, "one run each").delimiter(',').capture_default_str();
  app.add_option(
      "--mistakes", arguments.mistakes,
      "words: none, those of `tubectl simulate --mistake`, pan=MM, turn=DEG, zoom=FACTOR (unannounced)");
  app.add_option("--every", arguments.every, "only every so many-th exposure").in_range(1, 1000);
  app.add_option("--threads", arguments.threads, "runs at a time").in_range(1, 64).capture_default_str();
  app.add_option("--out", arguments.out,
                 "folder for sequences and geometry.json; sequences that are there are used again")
      .capture_default_str();
  if (const auto ended = program.parse(argc, argv)) return *ended;
  arguments.complete();
  try {
    run(arguments, command_line("geometry", argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "geometry_bench: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
