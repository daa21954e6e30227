// tubectl calibrate registration: from the tracker's frame to the world, by images from two directions.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/image_registration.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_coils.hpp"
#include "clients/tubectl/calibrate/coil_source.hpp"
#include "clients/tubectl/verbs.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

struct RegistrationOptions {
  std::string recording;
  ImageRegistrationSettings settings;
  std::string json;
  AcceptOptions accept;
};

nlohmann::json list_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::json json_of(const ImageRegistration& found) {
  const RigidCorrection& correction = found.correction;
  nlohmann::json matrix = nlohmann::json::array();
  for (int row = 0; row < 4; ++row) {
    const Eigen::Vector4d numbers = found.T_world_em.matrix().row(row).transpose();
    matrix.push_back({numbers[0], numbers[1], numbers[2], numbers[3]});
  }
  return {{"T_world_em", matrix},
          {"shift_mm", list_of(correction.shift_mm)},
          {"turn_rad", list_of(correction.turn_rad)},
          {"centre_world_mm", list_of(correction.centre_world_mm)},
          {"covariance", upper_triangle(correction.covariance)},
          {"worst_shift_mm", correction.worst_shift_mm()},
          {"local_mm", correction.local_mm},
          {"rms_before_mm", correction.rms_before_mm},
          {"rms_after_mm", correction.rms_after_mm},
          {"coil_rms_mm", found.coil_rms_mm},
          {"images", found.images},
          {"sightings", found.sightings},
          {"left_out", correction.left_out},
          {"directions_apart_deg", found.apart_rad / kDegree}};
}

int calibrate(const RegistrationOptions& options) {
  const ConfiguredSequence run = read_recording(options.recording, options.accept.config);
  const ImageRegistration found = register_by_images(run, options.settings);
  const ConfigurationFragment fragment = fragment_of(found);
  write_report(page_of(found, fragment), options.accept);
  if (options.json == "-") {
    std::cout << json_of(found).dump(2) << '\n';
    return offer_beside_json(fragment, options.accept);
  }
  return offer(fragment, options.accept);
}

}  // namespace

CommandLine add_calibrate_registration(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<RegistrationOptions>();
  CommandLine verb =
      app.add_subcommand("registration",
                         "Correct T_world_em by images from two directions: coils lie on the tube "
                         "that they show. From a recording of a swinging C-arm, or of two cameras");
  verb.add_option("RECORDING", options->recording, "Sequence folder, format 1, with images").required();
  verb.add_option("--max-sigma", options->settings.max_sigma_mm,
                  "What is known worse along some direction is refused, standard deviation, mm")
      .in_range(0.1, 50.0)
      .capture_default_str();
  verb.add_option("--field-mm", options->settings.field_mm,
                  "What the tracker's field may shift all coils by alike, standard deviation an axis, mm: it "
                  "cannot be "
                  "told from the registration, and is added to what is written of its error")
      .in_range(0.0, 20.0)
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer("Example:\n  tubectl calibrate registration swing --config /etc/tubed/tubed.toml");
  verb.callback([options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate(*options); }); });
  return verb;
}

}  // namespace tubed
