// tubectl calibrate coils: where coils sit along the catheter.
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/coil_findings.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_coils.hpp"
#include "clients/tubectl/calibrate/coil_source.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct CoilsOptions {
  CoilSourceOptions source;
  AcceptOptions accept;
  std::string tip_em_mm;  ///< X,Y,Z; empty: not touched
  double tip_sigma_mm = 0.5;
  std::optional<double> tip_beyond_mm;
  std::string json;
};

Eigen::Vector3d place_from(const std::string& text) {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  int read = 0;
  const int count = std::sscanf(text.c_str(), "%lf,%lf,%lf%n", &place.x(), &place.y(), &place.z(), &read);
  if (count != 3 || static_cast<std::size_t>(read) != text.size() || !place.allFinite()) {
    throw CalibrationError("--tip: expected X,Y,Z in mm, such as 12.1,-20.3,-148.8, found " + text);
  }
  return place;
}

template <typename Coils>
nlohmann::json json_of(const Coils& coils) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& coil : coils) {
    list.push_back({{"sensor", coil.sensor},
                    {"stated_mm", coil.stated_mm},
                    {"found_mm", coil.found_mm},
                    {"sigma_mm", coil.sigma_mm},
                    {"found", coil.was_found},
                    {"measurements", coil.measurements}});
  }
  return list;
}

int calibrate_straight(const CoilsOptions& options) {
  const std::vector<CoilRecording> recordings = read_coils(options.source, options.accept.config);
  StraightTip tip;
  if (!options.tip_em_mm.empty()) {
    tip.p_em_mm = place_from(options.tip_em_mm);
    tip.p_sigma_mm = options.tip_sigma_mm;
  } else if (options.tip_beyond_mm) {
    tip.beyond_coil_mm = *options.tip_beyond_mm;
    tip.beyond_sigma_mm = options.tip_sigma_mm;
  }
  const StraightCatheter found = measure_straight(recordings, tip);
  const ConfigurationFragment fragment = fragment_of(found, recordings.front().instrument.id);
  write_report(page_of(found, fragment), options.accept);
  for (const std::string& mistake : found.mistakes) {
    std::cerr << "tubectl: " << mistake << '\n';
  }
  if (options.json == "-") {
    std::cout << nlohmann::json{{"coils", json_of(found.coils)},
                                {"from_tip", found.has_tip},
                                {"line_rms_mm", found.line_rms_mm},
                                {"mistakes", found.mistakes},
                                {"remarks", found.remarks}}
                     .dump(2)
              << '\n';
  }
  if (!found.mistakes.empty()) {
    std::cerr << "tubectl: repair this first; nothing is offered\n";
    return kExitBadData;
  }
  return options.json == "-" ? offer_beside_json(fragment, options.accept) : offer(fragment, options.accept);
}

}  // namespace

CommandLine add_calibrate_coils(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<CoilsOptions>();
  CommandLine verb = app.add_subcommand("coils",
                                        "Arc lengths of the coils, from the catheter lying still in a "
                                        "straight groove; several recordings: the groove was moved between");
  add_coil_source_options(verb, options->source);
  Argument tip = verb.add_option("--tip", options->tip_em_mm,
                                 "X,Y,Z of the tip in the tracker's frame, mm, as a probe touched it or "
                                 "the stop is known");
  verb.add_option("--tip-beyond", options->tip_beyond_mm,
                  "From the middle of the first coil to the tip, mm, measured otherwise")
      .in_range(0.0, 500.0)
      .excludes(tip);
  verb.add_option("--tip-sigma", options->tip_sigma_mm, "Standard deviation of either, mm")
      .in_range(0.0, 50.0)
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer("Example:\n  tubectl calibrate coils still --tip 20,-10,-150 --config /etc/tubed/tubed.toml");
  verb.callback(
      [options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate_straight(*options); }); });
  return verb;
}

}  // namespace tubed
