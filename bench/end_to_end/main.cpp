// end_to_end_bench: from the exposure to the shape at a subscriber, through the real daemon, beside the
// paper's loop.
#include <cstdio>
#include <stdexcept>

#include "bench/session/latencies.hpp"
#include "bench/support/benchmark_program.hpp"
#include "bench/support/latency_plots.hpp"

namespace tubed {
namespace {

struct Choice {
  std::vector<double> rates_hz{30, 60, 120};
  int rounds = 2;
  double seconds = 10;
  bool any_cpu = false;
  std::string area = "band";
};

/// All rounds of one contestant at one rate.
struct Rounds {
  TimedValues written;
  TimedValues over_udp;
  TimedValues over_shm;
  TimedValues newer_shape;
  TimedValues cpu;
  TimedValues cpu_a_shape;
  TimedValues resident;
  TimedValues injected_late_us;
  std::vector<StageTimes> stages;
  ImageCounts images;
  double lost_udp = 0;
  double lost_shm = 0;
  double shift_s = 0;

  void add(const SessionRecord& record, double period_ms, double seconds);
};

TimedValues injected_late(const SessionRecord& record) {
  TimedValues values;
  for (const InjectedImage& image : record.images) {
    values.values.push_back(static_cast<double>(image.put_started_ns - image.exposure_ns) / 1e3);
    values.t_s.push_back(static_cast<double>(image.exposure_ns - record.start_ns) / 1e9);
  }
  return values;
}

void Rounds::add(const SessionRecord& record, double period_ms, double seconds) {
  written.append(exposure_to_written(record), shift_s);
  newer_shape.append(exposure_to_newer_shape(record), shift_s);
  injected_late_us.append(injected_late(record), shift_s);
  cpu.append(cpu_percent(record), shift_s);
  cpu_a_shape.append(cpu_ms_a_shape(record), shift_s);
  resident.append(resident_mb(record), shift_s);
  for (const auto& received : record.over_dds) {
    over_udp.append(exposure_to_received(record, received), shift_s);
    lost_udp += lost_of(received);
  }
  for (const auto& received : record.over_shm) {
    over_shm.append(exposure_to_received(record, received), shift_s);
    lost_shm += lost_of(received);
  }
  const std::vector<StageTimes> now = stage_times(record);
  stages.resize(now.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    stages[i].stage = now[i].stage;
    stages[i].times.append(now[i].times, shift_s);
  }
  const ImageCounts counts = count_images(record, period_ms);
  images.injected += counts.injected;
  images.used += counts.used;
  images.superseded += counts.superseded;
  images.late += counts.late;
  shift_s += seconds;
}

ReportRow row_of(const std::string& name, const std::string& unit, const TimedValues& own,
                 const TimedValues* peer) {
  ReportRow row{name, unit, own.values, "", {}, {}, own.t_s};
  if (peer != nullptr && !peer->values.empty()) {
    row.peer = "paper-loop";
    row.peer_values = peer->values;
  }
  return row;
}

void add_row(Report& report, ReportRow row) {
  if (!row.values.empty()) report.add(std::move(row));
}

std::map<std::string, double> counts_of(const Rounds& rounds) {
  return {{"images_injected", rounds.images.injected},
          {"images_used", rounds.images.used},
          {"images_superseded", rounds.images.superseded},
          {"images_late", rounds.images.late}};
}

void report_rate(const std::string& name, const Rounds& own, const Rounds& paper, Report& report) {
  ReportRow written = row_of(name + "/written", "ms", own.written, &paper.written);
  written.extra = counts_of(own);
  add_row(report, std::move(written));
  ReportRow udp = row_of(name + "/udp", "ms", own.over_udp, &paper.over_udp);
  udp.extra["lost"] = own.lost_udp;
  add_row(report, std::move(udp));
  ReportRow shm = row_of(name + "/shm", "ms", own.over_shm, nullptr);
  shm.extra["lost"] = own.lost_shm;
  add_row(report, std::move(shm));
  add_row(report, row_of(name + "/newer_shape", "ms", own.newer_shape, &paper.newer_shape));
  for (const StageTimes& stage : own.stages) {
    add_row(report, row_of(name + "/stage/" + stage.stage, "ms", stage.times, nullptr));
  }
  add_row(report, row_of(name + "/cpu", "%", own.cpu, &paper.cpu));
  add_row(report, row_of(name + "/cpu_a_shape", "ms", own.cpu_a_shape, &paper.cpu_a_shape));
  add_row(report, row_of(name + "/resident", "MB", own.resident, nullptr));
  add_row(report, row_of(name + "/grabber_late", "us", own.injected_late_us, nullptr));
  ReportRow loop = row_of(name + "/paper-loop/written", "ms", paper.written, nullptr);
  loop.extra = counts_of(paper);
  add_row(report, std::move(loop));
  for (const StageTimes& stage : paper.stages) {
    add_row(report, row_of(name + "/paper-loop/stage/" + stage.stage, "ms", stage.times, nullptr));
  }
}

void measure(const Choice& choice, Report& report) {
  for (const double rate_hz : choice.rates_hz) {
    SceneSettings settings;
    settings.rate_hz = rate_hz;
    settings.frangi_area = choice.area;
    const Scene scene(settings);
    Rounds own;
    Rounds paper;
    SessionPlan plan;
    plan.seconds = choice.seconds;
    plan.keep_to_one_cpu = !choice.any_cpu;
    for (int round = 0; round < choice.rounds; ++round) {
      for (const Contestant contestant : {Contestant::kDaemon, Contestant::kPaperLoop}) {
        plan.contestant = contestant;
        plan.shm_subscribers = contestant == Contestant::kDaemon ? 1 : 0;
        Rounds& rounds = contestant == Contestant::kDaemon ? own : paper;
        rounds.add(run_session(scene, plan), 1000 / rate_hz, choice.seconds);
      }
      std::fprintf(stderr, "%g Hz, round %d: done\n", rate_hz, round + 1);
    }
    char name[40];
    std::snprintf(name, sizeof name, "end_to_end/%g", rate_hz);
    if (own.written.values.empty())
      throw std::runtime_error(std::string(name) + ": no estimate had an image");
    report_rate(name, own, paper, report);
  }
}

/// Rates in the order of the file.
std::vector<std::string> rates_in(const nlohmann::json& report) {
  std::vector<std::string> rates;
  for (const auto& row : report.at("rows")) {
    const auto name = row.at("name").get<std::string>();
    if (name.ends_with("/written") && name.find("paper") == std::string::npos) {
      rates.push_back(name.substr(0, name.size() - 8));
    }
  }
  return rates;
}

std::vector<PlotPanel> panels_of(const nlohmann::json& report, const std::vector<std::string>& shown) {
  std::vector<PlotPanel> panels;
  for (const std::string& rate : rates_in(report)) {
    PlotPanel panel{rate.substr(11) + " Hz", {}};
    for (const auto& row : report.at("rows")) {
      const auto name = row.at("name").get<std::string>();
      for (const std::string& wanted : shown) {
        if (name == rate + "/" + wanted) panel.rows.push_back({wanted, row});
      }
    }
    panels.push_back(std::move(panel));
  }
  return panels;
}

std::map<std::string, std::string> draw(const nlohmann::json& report) {
  const std::vector<std::string> latencies{"written", "udp", "shm", "newer_shape", "paper-loop/written"};
  const std::vector<std::string> stages{"stage/grab",           "stage/wake frangi", "stage/frangi",
                                        "stage/wake optimizer", "stage/optimizer",   "stage/wake publisher",
                                        "stage/dds_write"};
  const std::string title =
      "From the intended exposure: dds_write returned, at subscribers; the paper's loop";
  return {{"", percentile_plots(title, panels_of(report, latencies))},
          {"histogram", histogram_plots(title, panels_of(report, latencies))},
          {"series", series_plots(title, panels_of(report, {"written", "paper-loop/written"}))},
          {"stages", percentile_plots("Each stage's part", panels_of(report, stages))}};
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"end_to_end",
       "From the intended exposure to the shape, through the real daemon, by turns with the paper's loop.",
       tubed::Surroundings::kOwnNetwork,
       [&](tubed::CommandLine app) {
         app.add_option("--rates", choice.rates_hz, "exposures a second")
             .delimiter(',')
             .capture_default_str();
         app.add_option("--rounds", choice.rounds, "turns of each side")
             .in_range(1, 100)
             .capture_default_str();
         app.add_option("--seconds", choice.seconds, "that count, of a turn")
             .in_range(2.0, 3600.0)
             .capture_default_str();
         app.add_option("--area", choice.area, "[frangi] area of the daemon")
             .is_member({"band", "frame"})
             .capture_default_str();
         app.add_flag("--any-cpu", choice.any_cpu, "do not keep the contestant to one CPU");
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); }, tubed::draw},
      argc, argv);
}
