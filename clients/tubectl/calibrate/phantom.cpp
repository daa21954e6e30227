// tubectl calibrate phantom: a phantom's file and simulated images of it, to try a calibration with.
#include <iostream>
#include <memory>

#include "clients/calibration/simulated_phantom.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_camera.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"

namespace tubed {

namespace {

struct PhantomOptions {
  std::string out;
  std::int64_t seed = 1;
  double dose_quanta = 1000;
  int bits = 16;
  std::vector<double> distortion;
  bool mirrored = false;
  std::string config;
  std::string camera;
};

/// The camera of a configuration with the phantom before it, or the built-in C-arm.
struct Laboratory {
  SimulatedCArm simulated = usual_c_arm();
  BallPhantom phantom = helix_phantom();
};

Laboratory laboratory_of(const PhantomOptions& options) {
  if (options.config.empty()) return {};
  const Configuration configuration = load_configuration(options.config);
  for (const CameraCalibration& camera : configuration.room.cameras) {
    if (options.camera.empty() || camera.name == options.camera) {
      return {c_arm_of(camera), phantom_before(camera)};
    }
  }
  throw PhantomError(options.config + ": has no camera \"" + options.camera + "\"");
}

int write_phantom(const PhantomOptions& options) {
  auto [simulated, phantom] = laboratory_of(options);
  simulated.exposure.seed = options.seed;
  simulated.exposure.detector.quanta_per_pixel = options.dose_quanta;
  simulated.exposure.bits = options.bits;
  simulated.mirrored = options.mirrored;
  std::copy_n(options.distortion.begin(), std::min<std::size_t>(5, options.distortion.size()),
              simulated.distortion.begin());
  try {
    const auto files = write_simulated_phantom(simulated, phantom, options.out);
    std::cout << options.out << ": phantom.toml, " << files.size()
              << " images (SIMULATED), angles.txt, truth.toml\nTry:\n  tubectl calibrate camera "
              << options.out << "/image-*.png --phantom " << options.out << "/phantom.toml --camera ";
    std::cout << (simulated.camera ? simulated.camera->name : "A") << " --pitch "
              << simulated.c_arm.pixel_pitch_mm << " --angles $(cat " << options.out << "/angles.txt)\n";
    return kExitOk;
  } catch (const PhantomError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_calibrate_phantom(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<PhantomOptions>();
  CommandLine verb =
      app.add_subcommand("phantom", "Write a phantom's file and simulated images of it, with truth");
  verb.add_option("--out", options->out, "Folder; is made").required();
  verb.add_option("--seed", options->seed, "Of the noise").capture_default_str();
  verb.add_option("--dose", options->dose_quanta, "Quanta in a pixel")
      .in_range(10.0, 1e6)
      .capture_default_str();
  verb.add_option("--bits", options->bits, "8 or 16").is_member({"8", "16"}).capture_default_str();
  verb.add_option("--distortion", options->distortion, "k1 k2 p1 p2 k3").expected(5, 5);
  verb.add_option("--config", options->config,
                  "Expose it with a camera of this configuration, from where that stands and from around it");
  verb.add_option("--camera", options->camera, "Which; left out: the first");
  verb.add_flag("--mirrored", options->mirrored, "Images as seen from the detector");
  verb.footer("Example:\n  tubectl calibrate phantom --config room.toml --camera A --out phantom");
  verb.callback(
      [options, &exit_code] { exit_code = saying_bad_data([&] { return write_phantom(*options); }); });
  return verb;
}

}  // namespace tubed
