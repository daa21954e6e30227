// tubectl pivot: where the tip of a probe is in its sensor's frame.
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/pivot_report.hpp"
#include "clients/calibration/registration_report.hpp"
#include "clients/calibration/tip_offset_file.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/live_probe.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "idl/dds_entity.hpp"

namespace tubed {

namespace {

struct PivotOptions {
  std::string samples;
  int sensor = 1;
  int freedom = 5;
  bool live = false;
  int coil = 1;
  double seconds = 20;
  double max_sigma_mm = 0.5;
  std::string json;
  Subscription subscription;
  AcceptOptions accept;  ///< --out and --report
};

/// Measurements of so many seconds, from the first one on at which the probe is seen.
std::vector<ProbePose> measure(const PivotOptions& options) {
  using std::chrono::steady_clock;
  LiveProbe probe(options.subscription, options.coil);
  const auto duration =
      std::chrono::duration_cast<steady_clock::duration>(std::chrono::duration<double>(options.seconds));
  std::vector<ProbePose> poses;
  std::cerr << "Put the tip into its hole and lean the probe slowly to all sides.\n";
  auto until = steady_clock::now() + duration;
  while (steady_clock::now() < until) {
    const auto pose = probe.wait_for(std::chrono::milliseconds{50});
    if (!pose || !pose->is_seen || (!poses.empty() && pose->frame == poses.back().frame)) continue;
    if (poses.empty()) {
      until = steady_clock::now() + duration;
      std::cerr << "Measuring for " << options.seconds << " s ...\n";
    }
    poses.push_back(*pose);
  }
  if (poses.empty()) {
    throw std::runtime_error("no measurement of the probe in " +
                             std::to_string(static_cast<int>(options.seconds)) +
                             " s: is tubed running in this domain and room, and the probe in the field?");
  }
  return poses;
}

int report(const JudgedPivot& judged, const PivotOptions& options, const std::string& source) {
  write_report(page_of(judged, source, date_of_today()), options.accept);
  const bool is_bad = worst(judged.findings) == ReportVerdict::kBad;
  if (options.json == "-") {
    std::cout << to_json(judged).dump(2) << '\n';
  } else {
    std::cout << to_text(judged.findings);
  }
  if (is_bad) return kExitBadData;
  const std::string text = tip_offset_text(judged.pivot, date_of_today());
  if (options.json != "-")
    std::cout << '\n' << text << "\ntubectl register ... " << tip_offset_option(judged.pivot) << '\n';
  if (!options.accept.out.empty()) {
    std::ofstream stream(options.accept.out);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error(options.accept.out + " cannot be written");
  }
  return kExitOk;
}

int pivot(const PivotOptions& options) {
  if (options.live == !options.samples.empty()) {
    refuse_usage("pivot", "give either --samples FILE or --live");
  }
  if (options.live && options.freedom == 6) {
    refuse_usage("pivot", "--dof 6 needs --samples: what a daemon publishes has no turn about a coil's axis");
  }
  const ProbeFreedom freedom = options.freedom == 6 ? ProbeFreedom::kSix : ProbeFreedom::kFive;
  try {
    const auto poses =
        options.live ? measure(options) : read_probe_poses(options.samples, options.sensor, freedom);
    const std::string source = options.live ? "measured live" : options.samples;
    return report(calibrate_pivot(poses, freedom, options.max_sigma_mm), options, source);
  } catch (const MarkerFileError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_pivot(CommandLine app, int& exit_code) {
  auto options = std::make_shared<PivotOptions>();
  CommandLine verb = app.add_subcommand("pivot", "Find a probe's tip by turning the probe about it");
  verb.add_option("--samples", options->samples,
                  "Measurements, with the columns of a sequence folder's em.csv");
  verb.add_option("--sensor", options->sensor, "Which sensor of --samples")
      .in_range(1, 64)
      .capture_default_str();
  verb.add_option("--dof", options->freedom, "Degrees of freedom of the sensor, 5 or 6")
      .in_range(5, 6)
      .capture_default_str();
  verb.add_flag("--live", options->live, "Measure now, with a running daemon");
  verb.add_option("--coil", options->coil, "With --live: which coil of the instrument, from its tip")
      .in_range(1, 16)
      .capture_default_str();
  verb.add_option("--seconds", options->seconds, "With --live: how long").positive().capture_default_str();
  verb.add_option("--max-sigma", options->max_sigma_mm, "Refuse a tip that is known worse than this, mm")
      .positive()
      .capture_default_str();
  verb.add_option("--out", options->accept.out,
                  "File for the tip, TOML, for `tubectl register --tip-offset-file`");
  verb.add_option("--report", options->accept.report, "File for a page about it, SVG");
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_dds_options(verb, options->subscription);
  verb.callback([options, &exit_code] { exit_code = pivot(*options); });
  return verb;
}

}  // namespace tubed
