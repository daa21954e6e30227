// tubectl calibrate time: by how much images are stamped too late against the coils.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/camera_clock.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_camera.hpp"
#include "clients/tubectl/calibrate/coil_source.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct TimeOptions {
  std::string recording;
  std::string camera;  ///< empty: all
  double max_sigma_ms = 10;
  std::string json;
  AcceptOptions accept;
};

std::vector<int> cameras_of(const TimeOptions& options, const RoomDescription& room) {
  std::vector<int> cameras;
  std::string names;
  for (std::size_t i = 0; i < room.cameras.size(); ++i) {
    names += " \"" + room.cameras[i].name + "\"";
    if (options.camera.empty() || room.cameras[i].name == options.camera) {
      cameras.push_back(static_cast<int>(i));
    }
  }
  if (cameras.empty()) {
    throw CalibrationError(options.recording + " has no camera \"" + options.camera + "\"; it has" + names);
  }
  return cameras;
}

nlohmann::json json_of(const std::vector<CameraClock>& clocks) {
  nlohmann::json list = nlohmann::json::array();
  for (const CameraClock& clock : clocks) {
    list.push_back({{"camera", clock.camera},
                    {"time_offset_ms", 1e3 * clock.offset_s()},
                    {"time_offset_sigma_ms", 1e3 * clock.found.sigma_s},
                    {"independent_sigma_ms", 1e3 * clock.found.white_sigma_s},
                    {"configured_ms", 1e3 * clock.configured_s},
                    {"images", clock.images},
                    {"places", clock.found.count},
                    {"blocks", clock.found.blocks},
                    {"left_px", clock.found.rms_px},
                    {"motion_px_s", clock.found.motion_px_s},
                    {"peak_in_sigmas", clock.found.peak_in_sigmas}});
  }
  return {{"cameras", list}};
}

int calibrate(const TimeOptions& options) {
  const ConfiguredSequence run = read_recording(options.recording, options.accept.config);
  std::vector<CameraClock> clocks;
  for (const int camera : cameras_of(options, run.sequence.room)) {
    clocks.push_back(measure_clock(run, camera, 1e-3 * options.max_sigma_ms));
  }
  const ConfigurationFragment fragment = fragment_of(clocks);
  write_report(page_of(clocks, fragment), options.accept);
  if (options.json == "-") {
    std::cout << json_of(clocks).dump(2) << '\n';
    return offer_beside_json(fragment, options.accept);
  }
  return offer(fragment, options.accept);
}

}  // namespace

CommandLine add_calibrate_time(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<TimeOptions>();
  CommandLine verb = app.add_subcommand("time",
                                        "By how much images are stamped too late against the coils: "
                                        "time_offset_ms, from a recording of the tip "
                                        "being moved to and fro in view");
  verb.add_option("RECORDING", options->recording, "Sequence folder, format 1, with images").required();
  verb.add_option("--camera", options->camera, "Only this one");
  verb.add_option("--max-sigma", options->max_sigma_ms, "What is known worse is refused, ms")
      .in_range(0.1, 200.0)
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer("Example:\n  tubectl calibrate time to-and-fro --config /etc/tubed/tubed.toml");
  verb.callback([options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate(*options); }); });
  return verb;
}

}  // namespace tubed
