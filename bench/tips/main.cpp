// tips_bench: catheters whose tip is a hook, with the rest shape told, withheld and told wrong: how far off
// the tip is, and whether it may be believed.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bench/tips/tip_runs.hpp"
#include "clients/evaluation/statistics.hpp"
#include "idl/command_line/command_line.hpp"

namespace tubed {
namespace {

struct Arguments {
  std::vector<std::string> radii{"6", "8", "12", "16", "30"};
  std::vector<double> arcs;  ///< instead of hooks
  std::vector<std::string> coils{"5", "10", "15"};
  std::vector<int> seeds{91, 92, 93};
  std::vector<std::string> told{"nothing", "as-it-is"};
  std::string preset = "preshaped";
  int second_view_every = 0;
  int every = 3;
  int threads = 2;
  std::string out = "tips";
};

ToldTip told_by(const std::string& word) {
  if (word == "nothing") return ToldTip::kNothing;
  if (word == "as-it-is") return ToldTip::kAsItIs;
  if (word == "straight") return ToldTip::kStraight;
  return ToldTip::kHook;
}

/// All seeds of one case.
struct Line {
  TipCase simulated;
  std::string told;
  TipOutcome pooled;
};

void add(const TipOutcome& outcome, TipOutcome& to) {
  const auto append = [](const std::vector<double>& from, std::vector<double>& all) {
    all.insert(all.end(), from.begin(), from.end());
  };
  append(outcome.tip_mm, to.tip_mm);
  append(outcome.rms_in_view_mm, to.rms_in_view_mm);
  append(outcome.em_rms_in_view_mm, to.em_rms_in_view_mm);
  to.valid += outcome.valid;
  to.valid_beyond_3_sigma += outcome.valid_beyond_3_sigma;
  to.valid_beyond_3_sigma_and_mm += outcome.valid_beyond_3_sigma_and_mm;
  to.beyond_3_sigma += outcome.beyond_3_sigma;
  for (const auto& [reason, count] : outcome.reasons) to.reasons[reason] += count;
  to.cpu_s += outcome.cpu_s;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

double percent(std::size_t part, std::size_t of) {
  return of == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(of);
}

void print(const Line& line) {
  const TipOutcome& all = line.pooled;
  std::printf("%-10s %4.0f %5.0f  %-9s %6zu  %5.2f %6.2f %6.1f %6.1f %6.1f %6.1f   %5.2f %5.2f  %5.2f  ",
              line.simulated.preset.c_str(), line.simulated.hook_radius_mm, line.simulated.tip_coil_mm,
              line.told.c_str(), all.tip_mm.size(), percentile(all.tip_mm, 0.5), percentile(all.tip_mm, 0.95),
              percent(all.valid, all.tip_mm.size()), percent(all.valid_beyond_3_sigma, all.valid),
              percent(all.valid_beyond_3_sigma_and_mm, all.valid),
              percent(all.beyond_3_sigma, all.tip_mm.size()), percentile(all.rms_in_view_mm, 0.5),
              percentile(all.rms_in_view_mm, 0.95), percentile(all.em_rms_in_view_mm, 0.5));
  std::vector<std::pair<std::size_t, std::string>> sorted;
  for (const auto& [reason, count] : all.reasons) {
    if (reason != "DEMO_DATA" && reason != "REPLAY_DATA") sorted.emplace_back(count, reason);
  }
  std::sort(sorted.rbegin(), sorted.rend());
  for (std::size_t i = 0; i < std::min<std::size_t>(3, sorted.size()); ++i) {
    std::printf("%s%s %.0f %%", i == 0 ? "" : ", ", sorted[i].second.c_str(),
                percent(sorted[i].first, all.tip_mm.size()));
  }
  std::printf("  (%.1f s)\n", all.cpu_s);
  std::fflush(stdout);
}

std::vector<Line> lines_of(const Arguments& arguments) {
  std::vector<Line> lines;
  for (const std::string& radius : arguments.radii) {
    for (const std::string& coil : arguments.coils) {
      for (const std::string& told : arguments.told) {
        lines.push_back({{arguments.preset, std::stod(radius), std::stod(coil), arguments.second_view_every,
                          arguments.arcs},
                         told,
                         {}});
      }
    }
  }
  return lines;
}

void run(const Arguments& arguments, std::vector<Line> lines) {
  std::printf("%-10s %4s %5s  %-9s %6s  %5s %6s %6s %6s %6s %6s   %5s %5s  %5s  reasons\n", "preset", "R mm",
              "coil", "told", "n", "tip", "p95", "VALID%", "V>3s%", "misl.%", ">3s%", "RMS", "p95", "EM");
  std::atomic<std::size_t> next{0};
  std::mutex printing;
  const auto work = [&] {
    // What is told differs between lines of one case, which have their sequences in common.
    const std::size_t each = arguments.told.size();
    for (std::size_t i = each * next++; i < lines.size(); i = each * next++) {
      for (std::size_t k = i; k < i + each; ++k) {
        for (const int seed : arguments.seeds) {
          add(run_tip(lines[k].simulated, told_by(lines[k].told), seed, arguments.every, arguments.out),
              lines[k].pooled);
        }
        const std::lock_guard lock(printing);
        print(lines[k]);
      }
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < arguments.threads; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  using namespace tubed;
  Program program("Simulated catheters with a pre-shaped tip, judged by their truth", "tips_bench");
  CommandLine app = program.command_line();
  Arguments arguments;
  app.add_option("--radii", arguments.radii, "of the hooks, mm; 0 = as the preset has it").delimiter(',');
  app.add_option("--arcs", arguments.arcs,
                 "instead of hooks one tip of several arcs: L,R,L,R.., as tubectl simulate --hook-arcs")
      .delimiter(',');
  app.add_option("--coils", arguments.coils, "arc lengths of the first coil, mm from the tip").delimiter(',');
  app.add_option("--seeds", arguments.seeds, "one run each").delimiter(',');
  app.add_option("--told", arguments.told, "what the estimator knows: nothing, as-it-is, straight, hook")
      .delimiter(',');
  app.add_option("--preset", arguments.preset, "one of `tubectl simulate`");
  app.add_option("--second-view-every", arguments.second_view_every,
                 "a second view with every so many-th exposure; 0 = none");
  app.add_option("--every", arguments.every, "only every so many-th exposure").in_range(1, 1000);
  app.add_option("--threads", arguments.threads, "runs side by side").in_range(1, 64);
  app.add_option("--out", arguments.out, "folder of the sequences, kept for the next time");
  if (const auto code = program.parse(argc, argv)) {
    return *code;
  }
  if (!arguments.arcs.empty()) arguments.radii = {"0"};
  std::vector<Line> lines = lines_of(arguments);
  try {
    for (const Line& line : lines) check_tip(line.simulated, arguments.seeds.front());
  } catch (const std::exception& error) {
    std::cerr << "tips_bench: " << error.what() << '\n';
    return Program::kExitOfUsage;
  }
  run(arguments, std::move(lines));
  return 0;
}
