// load_bench: how latency and cost of the daemon grow with what it has to do.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "bench/session/latencies.hpp"
#include "bench/support/benchmark_program.hpp"
#include "bench/support/latency_plots.hpp"

namespace tubed {
namespace {

struct Choice {
  double seconds = 5;
  int rounds = 2;
  std::string only;
  bool any_cpu = false;
};

/// One value of one thing that varies.
struct LoadCase {
  std::string varied;  ///< "subscribers"
  double value;
  SceneSettings scene;
  SessionPlan plan;
};

LoadCase changed(const std::string& varied, double value, const std::function<void(LoadCase&)>& change) {
  LoadCase made{varied, value, {}, {}};
  change(made);
  return made;
}

std::vector<LoadCase> all_cases() {
  std::vector<LoadCase> cases;
  for (const int hogs : {0, 1, 2})
    cases.push_back(changed("hogs", hogs, [=](LoadCase& c) { c.plan.hogs = hogs; }));
  for (const int slow : {0, 1, 4}) {
    cases.push_back(changed("slow_subscribers", slow, [=](LoadCase& c) { c.plan.slow_subscribers = slow; }));
  }
  for (const int subscribers : {1, 4, 8, 32}) {
    cases.push_back(
        changed("subscribers", subscribers, [=](LoadCase& c) { c.plan.dds_subscribers = subscribers; }));
  }
  for (const int readers : {1, 4, 8, 32}) {
    cases.push_back(changed("shm_readers", readers, [=](LoadCase& c) { c.plan.shm_subscribers = readers; }));
  }
  for (const int instruments : {1, 2, 4, 8}) {
    cases.push_back(
        changed("instruments", instruments, [=](LoadCase& c) { c.scene.instruments = instruments; }));
  }
  for (const int cameras : {1, 2}) {
    cases.push_back(changed("cameras", cameras, [=](LoadCase& c) { c.scene.cameras = cameras; }));
  }
  for (const auto& [width, height] :
       {std::pair{400, 600}, {640, 640}, {1024, 1024}, {1440, 1440}, {2048, 2048}}) {
    cases.push_back(changed("megapixels", width * height / 1e6, [w = width, h = height](LoadCase& c) {
      c.scene.width = w;
      c.scene.height = h;
      c.scene.rate_hz = 10;  // so that the largest is finished before the next comes
    }));
  }
  for (const int coefficients : {20, 26, 34, 48}) {
    cases.push_back(changed("coefficients", coefficients,
                            [=](LoadCase& c) { c.scene.coefficient_count = coefficients; }));
  }
  return cases;
}

/// What the rounds of one case gave.
struct Measured {
  TimedValues written;
  TimedValues last_instrument;
  TimedValues cpu;
  TimedValues cpu_a_shape;
  TimedValues resident;
  std::map<std::string, std::vector<double>> stages;
  double superseded = 0;
  double late = 0;
  double lost = 0;
};

/// Exposure to dds_write returned of the last instrument, which waits for all before it.
TimedValues last_written(SessionRecord record, int instruments) {
  std::erase_if(record.written, [=](const WrittenEstimate& w) {
    return w.instrument != static_cast<std::uint32_t>(instruments);
  });
  for (WrittenEstimate& written : record.written) written.instrument = 1;
  return exposure_to_written(record);
}

void add_session(Measured& measured, const SessionRecord& record, const LoadCase& load, double shift_s) {
  measured.written.append(exposure_to_written(record), shift_s);
  measured.last_instrument.append(last_written(record, load.scene.instruments), shift_s);
  measured.cpu.append(cpu_percent(record), shift_s);
  measured.cpu_a_shape.append(cpu_ms_a_shape(record), shift_s);
  measured.resident.append(resident_mb(record), shift_s);
  for (const StageTimes& stage : stage_times(record)) {
    std::vector<double>& values = measured.stages[stage.stage];
    values.insert(values.end(), stage.times.values.begin(), stage.times.values.end());
  }
  const ImageCounts images = count_images(record, 1000 / load.scene.rate_hz);
  measured.superseded += images.superseded;
  measured.late += images.late;
  for (int i = 0; i < load.plan.dds_subscribers; ++i)
    measured.lost += lost_of(record.over_dds[static_cast<std::size_t>(i)]);
}

std::string name_of(const LoadCase& load) {
  char text[80];
  std::snprintf(text, sizeof text, "load/%s/%g", load.varied.c_str(), load.value);
  return text;
}

void report_case(const LoadCase& load, const Measured& measured, Report& report) {
  const std::string name = name_of(load);
  if (measured.written.values.empty()) {
    report.add({name + "/written", "ms", {NAN}, "", {}, {{"images_superseded", measured.superseded}}, {}});
    return;
  }
  ReportRow written{name + "/written", "ms", measured.written.values, "", {}, {}, measured.written.t_s};
  for (const auto& [stage, values] : measured.stages)
    written.extra[stage + "_p50_ms"] = percentile(values, 50);
  written.extra["dds_write_max_ms"] = percentile(measured.stages.at("dds_write"), 100);
  written.extra["images_superseded"] = measured.superseded;
  written.extra["images_late"] = measured.late;
  written.extra["samples_lost"] = measured.lost;
  report.add(std::move(written));
  report.add({name + "/written_last_instrument", "ms", measured.last_instrument.values, "", {}, {}, {}});
  report.add({name + "/cpu", "%", measured.cpu.values, "", {}, {}, measured.cpu.t_s});
  report.add({name + "/cpu_a_shape", "ms", measured.cpu_a_shape.values, "", {}, {}, {}});
  report.add({name + "/resident", "MB", measured.resident.values, "", {}, {}, measured.resident.t_s});
}

/// How far the CPU times of a shape are from a straight line over the varied value, % of the line: one value
/// a case.
std::vector<double> off_the_line(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sx += x[i];
    sy += y[i];
    sxx += x[i] * x[i];
    sxy += x[i] * y[i];
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  const double offset = (sy - slope * sx) / n;
  std::vector<double> off;
  for (std::size_t i = 0; i < x.size(); ++i)
    off.push_back(100 * std::abs(y[i] / (offset + slope * x[i]) - 1));
  return off;
}

void report_growth(const std::vector<LoadCase>& cases, const std::vector<Measured>& measured,
                   Report& report) {
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> cpu;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (measured[i].cpu_a_shape.values.empty()) continue;
    cpu[cases[i].varied].first.push_back(cases[i].value);
    cpu[cases[i].varied].second.push_back(percentile(measured[i].cpu_a_shape.values, 50));
  }
  for (const auto& [varied, line] : cpu) {
    if (line.first.size() >= 3) {
      report.add(
          {"load/" + varied + "/cpu_off_a_line", "%", off_the_line(line.first, line.second), "", {}, {}, {}});
    }
  }
}

void measure(const Choice& choice, Report& report) {
  std::vector<LoadCase> cases = all_cases();
  std::erase_if(cases,
                [&](const LoadCase& load) { return name_of(load).find(choice.only) == std::string::npos; });
  std::vector<Measured> measured(cases.size());
  for (int round = 0; round < choice.rounds; ++round) {
    for (std::size_t i = 0; i < cases.size(); ++i) {
      cases[i].plan.seconds = choice.seconds;
      cases[i].plan.keep_to_one_cpu = !choice.any_cpu;
      const Scene scene(cases[i].scene);
      add_session(measured[i], run_session(scene, cases[i].plan), cases[i], round * choice.seconds);
      std::fprintf(stderr, "%s, round %d: done\n", name_of(cases[i]).c_str(), round + 1);
    }
  }
  for (std::size_t i = 0; i < cases.size(); ++i) report_case(cases[i], measured[i], report);
  report_growth(cases, measured, report);
}

/// p50 of rows "load/<varied>/<value>/<figure>", or a member of theirs.
GrowthCurve curve_of(const nlohmann::json& report, const std::string& varied, const std::string& figure,
                     const std::string& member, const std::string& label) {
  GrowthCurve curve{label, {}, {}};
  const std::string begin = "load/" + varied + "/";
  for (const auto& row : report.at("rows")) {
    const auto name = row.at("name").get<std::string>();
    if (!name.starts_with(begin) || !name.ends_with("/" + figure) || !row.contains(member) ||
        row[member].is_null()) {
      continue;
    }
    curve.x.push_back(std::strtod(name.c_str() + begin.size(), nullptr));
    curve.y.push_back(row[member]);
  }
  return curve;
}

std::map<std::string, std::string> draw(const nlohmann::json& report) {
  std::vector<GrowthPanel> latencies;
  std::vector<GrowthPanel> costs;
  for (const char* varied : {"subscribers", "shm_readers", "slow_subscribers", "hogs", "instruments",
                             "cameras", "megapixels", "coefficients"}) {
    if (curve_of(report, varied, "written", "p50", "").x.empty()) continue;
    latencies.push_back({"exposure to written, ms",
                         varied,
                         {curve_of(report, varied, "written", "p50", "p50"),
                          curve_of(report, varied, "written", "p99", "p99"),
                          curve_of(report, varied, "written_last_instrument", "p50", "last instrument, p50"),
                          curve_of(report, varied, "written", "frangi_p50_ms", "Frangi, p50"),
                          curve_of(report, varied, "written", "optimizer_p50_ms", "optimizer, p50"),
                          curve_of(report, varied, "written", "dds_write_p50_ms", "dds_write, p50")}});
    costs.push_back({"CPU, % of a core; CPU of a shape, ms; memory, MB",
                     varied,
                     {curve_of(report, varied, "cpu_a_shape", "p50", "CPU of a shape"),
                      curve_of(report, varied, "cpu", "p50", "CPU"),
                      curve_of(report, varied, "resident", "p50", "resident")}});
  }
  return {{"", growth_plots("How latency grows", latencies)},
          {"cost", growth_plots("How cost grows", costs)}};
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"load", "How latency and cost of the daemon grow with what it has to do.",
       tubed::Surroundings::kOwnNetwork,
       [&](tubed::CommandLine app) {
         app.add_option("--seconds", choice.seconds, "of a turn").in_range(2.0, 3600.0).capture_default_str();
         app.add_option("--rounds", choice.rounds, "turns of every case")
             .in_range(1, 100)
             .capture_default_str();
         app.add_option("--only", choice.only, "only cases whose names contain this");
         app.add_flag("--any-cpu", choice.any_cpu, "do not keep the daemon to one CPU");
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); }, tubed::draw},
      argc, argv);
}
