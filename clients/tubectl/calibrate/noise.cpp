// tubectl calibrate noise: how coils shake, still or moving, and how far the field puts them off.
#include <array>
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

struct NoiseOptions {
  CoilSourceOptions source;
  AcceptOptions accept;
  std::optional<double> field_mm;
  std::string places;
  std::string places_recording;
  int places_sensor = 1;
  std::string json;
  bool is_moving = false;
};

nlohmann::json json_of(const StillCoil& coil) {
  return {{"sensor", coil.sensor},
          {"measurements", coil.measurements},
          {"white_mm", {coil.white_mm.x(), coil.white_mm.y(), coil.white_mm.z()}},
          {"white_sigma_mm", coil.white_sigma_mm},
          {"tangent", coil.tangent},
          {"mean_of_40_mm", coil.averaged_mm},
          {"white_leaves_mm", coil.expected_mm},
          {"drift_mm_min", coil.drift_mm_min},
          {"interference_hz", coil.interference_hz},
          {"interference_mm", coil.interference_mm}};
}

nlohmann::json json_of(const MovingCoil& coil) {
  return {{"sensor", coil.sensor},
          {"measurements", coil.differences},
          {"median_mm_s", coil.median_mm_s},
          {"white_axis_mm", coil.noise_mm},
          {"slower_half_mm", coil.slow_noise_mm},
          {"faster_half_mm", coil.fast_noise_mm},
          {"tangent", coil.tangent}};
}

/// Of StillNoise or MovingNoise.
template <typename Noise>
nlohmann::json json_of(const Noise& noise, const FieldError* field) {
  nlohmann::json coils = nlohmann::json::array();
  for (const auto& coil : noise.coils) coils.push_back(json_of(coil));
  nlohmann::json all{{"coils", coils},
                     {"rate_hz", noise.rate_hz},
                     {"position_mm", noise.position_mm},
                     {"tangent", noise.tangent},
                     {"remarks", noise.remarks}};
  if (field != nullptr) {
    nlohmann::json bands = nlohmann::json::array();
    for (const DistanceBand& band : field->bands) {
      bands.push_back({{"from_mm", band.from_mm},
                       {"until_mm", band.until_mm},
                       {"places", band.places},
                       {"rms_mm", band.rms_mm}});
    }
    all["field"] = {{"axis_mm", field->axis_mm}, {"axis_sigma_mm", field->axis_sigma_mm}, {"bands", bands}};
  }
  return all;
}

void print_bands(const FieldError& field) {
  std::cerr << "distance from the generator, mm   places   RMS mm   an axis mm\n";
  for (const DistanceBand& band : field.bands) {
    std::array<char, 96> row{};
    std::snprintf(row.data(), row.size(), "%14.0f to %-16.0f %6d %8.2f %12.2f\n", band.from_mm, band.until_mm,
                  band.places, band.rms_mm, band.axis_mm);
    std::cerr << row.data();
  }
}

template <typename Noise>
int report_noise(const Noise& noise, const NoiseOptions& options) {
  std::optional<FieldError> field;
  if (!options.places.empty()) {
    const CoilRecording moved =
        coils_of(read_recording(options.places_recording, options.accept.config).sequence);
    field = find_field_error(moved, options.places_sensor, read_places(options.places));
  }
  const double field_mm = field ? field->axis_mm : options.field_mm.value_or(-1);
  const ConfigurationFragment fragment = fragment_of(noise, field_mm);
  write_report(page_of(noise, field ? &*field : nullptr, fragment), options.accept);
  if (options.json == "-") {
    std::cout << json_of(noise, field ? &*field : nullptr).dump(2) << '\n';
    return offer_beside_json(fragment, options.accept);
  }
  if (field) {
    print_bands(*field);
  }
  return offer(fragment, options.accept);
}

int calibrate_noise(const NoiseOptions& options) {
  const std::vector<CoilRecording> recordings = read_coils(options.source, options.accept.config);
  if (recordings.size() != 1) {
    throw CalibrationError(std::string("name one recording of ") + (options.is_moving ? "moving" : "still") +
                           " coils");
  }
  return options.is_moving ? report_noise(measure_moving(recordings.front()), options)
                           : report_noise(measure_still(recordings.front()), options);
}

}  // namespace

CommandLine add_calibrate_noise(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<NoiseOptions>();
  CommandLine verb = app.add_subcommand(
      "noise", "Noise of coils that are still, or moving, and what the field adds: sigma_position_mm");
  add_coil_source_options(verb, options->source);
  verb.add_flag("--moving", options->is_moving,
                "The coils moved: a catheter in use; noise by third differences, slow and fast apart");
  verb.add_option("--field-mm", options->field_mm, "The field's error as known otherwise, mm an axis")
      .in_range(0.0, 50.0);
  const Argument places =
      verb.add_option("--places", options->places,
                      "CSV from_s,until_s,x,y,z: places of a board and when a coil rested there, mm");
  verb.add_option("--places-recording", options->places_recording, "The recording of that coil")
      .needs(places);
  verb.add_option("--places-sensor", options->places_sensor, "Its sensor")
      .in_range(1, 16)
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer(
      "Examples:\n  tubectl calibrate noise still --field-mm 1 --config /etc/tubed/tubed.toml\n"
      "  tubectl calibrate noise run --moving --report noise.svg");
  verb.callback(
      [options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate_noise(*options); }); });
  return verb;
}

}  // namespace tubed
