// tubectl calibrate arc-lengths: where coils sit along the catheter, from a recording of it in use.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/arc_lengths.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_coils.hpp"
#include "clients/tubectl/calibrate/coil_source.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct ArcLengthOptions {
  std::string recording;
  ArcLengthSettings settings;
  std::string json;
  AcceptOptions accept;
};

nlohmann::json json_of(const MeasuredPiece& piece) {
  return {{"stated_mm", piece.stated_mm},
          {"measured_mm", piece.found_mm},
          {"sigma_mm", piece.sigma_mm},
          {"changed", piece.is_changed}};
}

nlohmann::json json_of(const ArcLengths& found) {
  nlohmann::json pieces = nlohmann::json::array();
  for (const MeasuredPiece& piece : found.pieces) pieces.push_back(json_of(piece));
  nlohmann::json coils = nlohmann::json::array();
  for (const MeasuredCoil& coil : found.coils) {
    coils.push_back({{"sensor", coil.sensor},
                     {"stated_mm", coil.stated_mm},
                     {"found_mm", coil.found_mm},
                     {"sigma_mm", coil.sigma_mm},
                     {"found", coil.was_found},
                     {"measurements", coil.measurements}});
  }
  return {{"coils", coils},
          {"from_tip", found.has_end()},
          {"ends_seen", found.end.measurements},
          {"end_scatter_mm", found.end.scatter_mm},
          {"end", json_of(found.end)},
          {"pieces", pieces}};
}

int calibrate(const ArcLengthOptions& options) {
  const ConfiguredSequence run = read_recording(options.recording, options.accept.config);
  const ArcLengths found = measure_arc_lengths(run, options.settings);
  const ConfigurationFragment fragment = fragment_of(found, run.sequence.room.instruments.front().id);
  write_report(page_of(found, fragment), options.accept);
  if (options.json == "-") {
    std::cout << json_of(found).dump(2) << '\n';
    return offer_beside_json(fragment, options.accept);
  }
  return offer(fragment, options.accept);
}

}  // namespace

CommandLine add_calibrate_arc_lengths(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<ArcLengthOptions>();
  CommandLine verb =
      app.add_subcommand("arc-lengths",
                         "Arc lengths of the coils from a recording of the catheter in use: distances "
                         "by the coils, and where images show its end");
  verb.add_option("RECORDING", options->recording, "Sequence folder, format 1").required();
  verb.add_option(
          "--field-mm", options->settings.field_mm,
          "What the tracker's field may change the distance of neighbouring coils by, standard deviation, mm")
      .in_range(0.0, 20.0)
      .capture_default_str();
  verb.add_flag("--all", options->settings.take_all,
                "Take every measured length, also where it differs from what is stated by no more than "
                "chance (2 sigma)");
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer("Example:\n  tubectl calibrate arc-lengths recording --config /etc/tubed/tubed.toml");
  verb.callback([options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate(*options); }); });
  return verb;
}

}  // namespace tubed
