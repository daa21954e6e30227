// soak_bench: what grows, and what gets slower, while the daemon runs.
#include <cstdio>

#include "bench/session/latencies.hpp"
#include "bench/support/benchmark_program.hpp"
#include "bench/support/latency_plots.hpp"

namespace tubed {
namespace {

struct Choice {
  double minutes = 10;
  double rate_hz = 30;
};

using Cost = double ProcessCosts::*;

void add_costs(Report& report, const SessionRecord& record, const std::string& name, const std::string& unit,
               Cost cost) {
  ReportRow row{name, unit, {}, "", {}, {}, {}};
  for (const ProcessCosts& costs : record.costs) {
    row.values.push_back(costs.*cost);
    row.t_s.push_back(costs.t_s);
  }
  row.extra["first"] = row.values.front();
  row.extra["last"] = row.values.back();
  row.extra["growth"] = row.values.back() - row.values.front();
  report.add(std::move(row));
}

/// Differences from second to second of a counter.
void add_rate(Report& report, const SessionRecord& record, const std::string& name, Cost counter) {
  ReportRow row{name, "1/s", {}, "", {}, {}, {}};
  for (std::size_t i = 1; i < record.costs.size(); ++i) {
    const ProcessCosts& before = record.costs[i - 1];
    const ProcessCosts& now = record.costs[i];
    row.values.push_back((now.*counter - before.*counter) / (now.t_s - before.t_s));
    row.t_s.push_back(now.t_s);
  }
  report.add(std::move(row));
}

void add_threads(Report& report, const SessionRecord& record) {
  const ProcessCosts& first = record.costs.front();
  const ProcessCosts& last = record.costs.back();
  for (const auto& [thread, switches] : last.thread_switches) {
    const auto before = first.thread_switches.find(thread);
    const double count = switches - (before == first.thread_switches.end() ? 0 : before->second);
    report.add({"soak/switches/" + thread, "1/s", {count / (last.t_s - first.t_s)}, "", {}, {}, {}});
  }
  for (const auto& [stage, allocations] : record.thread_allocations) {
    report.add({"soak/allocations/" + stage, "allocations", {allocations}, "", {}, {}, {}});
  }
}

void add_values(Report& report, const std::string& name, const std::string& unit, const TimedValues& values,
                std::map<std::string, double> extra = {}) {
  if (!values.values.empty()) report.add({name, unit, values.values, "", {}, std::move(extra), values.t_s});
}

void measure(const Choice& choice, Report& report) {
  SceneSettings settings;
  settings.rate_hz = choice.rate_hz;
  const Scene scene(settings);
  SessionPlan plan;
  plan.warm_up_s = 5;
  plan.seconds = 60 * choice.minutes;
  plan.watches_health = true;
  const SessionRecord record = run_session(scene, plan);
  const ImageCounts images = count_images(record, 1000 / choice.rate_hz);
  add_values(report, "soak/written", "ms", exposure_to_written(record),
             {{"images_injected", images.injected},
              {"images_superseded", images.superseded},
              {"images_late", images.late}});
  add_values(report, "soak/udp", "ms", exposure_to_received(record, record.over_dds.front()),
             {{"lost", lost_of(record.over_dds.front())}});
  add_values(report, "soak/shm", "ms", exposure_to_received(record, record.over_shm.front()),
             {{"lost", lost_of(record.over_shm.front())}});
  add_values(report, "soak/cpu", "%", cpu_percent(record));
  add_costs(report, record, "soak/resident", "MB", &ProcessCosts::resident_mb);
  add_costs(report, record, "soak/descriptors", "descriptors", &ProcessCosts::descriptors);
  add_rate(report, record, "soak/voluntary_switches", &ProcessCosts::voluntary_switches);
  add_rate(report, record, "soak/involuntary_switches", &ProcessCosts::involuntary_switches);
  add_threads(report, record);
}

std::map<std::string, std::string> draw(const nlohmann::json& report) {
  const auto panel = [&](const std::string& title, const std::vector<std::string>& names) {
    PlotPanel made{title, {}};
    for (const std::string& name : names) {
      for (PlottedRow& row : panel_of("", report, "soak/" + name).rows) {
        if (row.label.empty()) made.rows.push_back({name, row.row});
      }
    }
    return made;
  };
  return {{"", series_plots(
                   "While the daemon runs",
                   {panel("from exposure", {"written", "udp", "shm"}), panel("resident memory", {"resident"}),
                    panel("descriptors", {"descriptors"}), panel("CPU, share of a core", {"cpu"}),
                    panel("context switches", {"voluntary_switches", "involuntary_switches"})})}};
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"soak", "What grows and what gets slower while the daemon runs.", tubed::Surroundings::kOwnNetwork,
       [&](tubed::CommandLine app) {
         app.add_option("--minutes", choice.minutes, "how long").in_range(0.1, 10000.0).capture_default_str();
         app.add_option("--rate", choice.rate_hz, "exposures a second")
             .in_range(1.0, 120.0)
             .capture_default_str();
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); }, tubed::draw},
      argc, argv);
}
