// tubectl grab: a frame grabber made of a sequence folder, a DICOM run, or a capture card; writes its images
// into shared memory in real time.
#include <grp.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "clients/tubectl/run/grab_dicom.hpp"
#include "clients/tubectl/run/grab_video.hpp"
#include "clients/tubectl/run/grab_view.hpp"
#include "clients/tubectl/run/setting_options.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead_over.hpp"
#include "drivers/replay/replayed_folder.hpp"
#include "drivers/v4l2/v4l2_settings.hpp"

namespace tubed {
namespace {

struct GrabArguments {
  std::string folder;
  std::string video;           // device; empty: the folder is played
  std::string dicom;           // run; empty: the folder is played
  double rate_hz = 0;          // of the run; 0: as it says
  std::string config;          // whose C-arm the run's angles turn
  std::string into;            // folder for run and coils; empty: into shared memory
  std::string coils;           // of that folder
  std::optional<double> at_s;  // of the run's first image, in the coils' time
  std::string camera;          // empty: the first
  std::string socket;
  std::string group;
  std::int64_t start_monotonic_ns = 0;
  double duration_s = 0;  // 0: to the end of the sequence
  bool loop = false;
};

constexpr std::int64_t kMemoryLimitMb = 2048;

volatile std::sig_atomic_t g_asked_to_end = 0;

std::size_t index_of(const ReplayedFolder& folder, const std::string& camera) {
  const auto& cameras = folder.sequence.room.cameras;
  const auto found = std::find_if(cameras.begin(), cameras.end(),
                                  [&](const CameraCalibration& each) { return each.name == camera; });
  if (found == cameras.end()) {
    throw std::runtime_error(folder.sequence.folder.string() + " has no camera '" + camera + "'");
  }
  return static_cast<std::size_t>(found - cameras.begin());
}

std::string first_camera(const std::string& folder) { return read_sequence(folder).room.cameras.at(0).name; }

std::optional<gid_t> group_id(const std::string& name) {
  if (name.empty()) {
    return {};
  }
  const group* found = getgrnam(name.c_str());
  if (found == nullptr) {
    throw ShmError("this system has no group '" + name + "'");
  }
  return found->gr_gid;
}

MonotonicTime end_of(const GrabArguments& arguments) {
  return arguments.duration_s == 0 ? MonotonicTime::max()
                                   : monotonic_now() + to_nanoseconds(arguments.duration_s);
}

int told(std::uint64_t written) {
  std::cerr << "tubectl: " << written << " images written\n";
  return written > 0 ? kExitOk : kExitFailed;
}

int grab_card(const GrabArguments& arguments, const DriverSettings& settings) {
  return told(grab_video({.device = arguments.video,
                          .camera = arguments.camera.empty() ? "A" : arguments.camera,
                          .socket = arguments.socket,
                          .group = group_id(arguments.group),
                          .settings = settings,
                          .end = end_of(arguments)},
                         g_asked_to_end));
}

int grab(const GrabArguments& arguments) {
  const std::string camera = arguments.camera.empty() ? first_camera(arguments.folder) : arguments.camera;
  FolderLease lease(arguments.folder, camera);
  const ReplayedFolder& folder = lease.open(kMemoryLimitMb);
  const CameraCalibration& calibration = folder.sequence.room.cameras[index_of(folder, camera)];
  const ReplayedView& view = folder.views[index_of(folder, camera)];
  ShmImageWriter writer({.socket = arguments.socket,
                         .camera = camera,
                         .max_width = static_cast<std::uint32_t>(calibration.width),
                         .max_height = static_cast<std::uint32_t>(calibration.height),
                         .max_depth_bits = 16,
                         .group = group_id(arguments.group)});
  const DriverSettings settings(
      {{"loop", arguments.loop}, {"start_monotonic_ns", arguments.start_monotonic_ns}});
  std::cerr << "tubectl: camera " << camera << ' ' << calibration.width << " x " << calibration.height
            << " at " << arguments.socket << '\n';
  return told(write_view(view, playhead_over(view.rows, folder, settings), writer, end_of(arguments),
                         g_asked_to_end));
}

int grab_run(const GrabArguments& arguments) {
  return told(grab_dicom({.run = arguments.dicom,
                          .rate_hz = arguments.rate_hz,
                          .camera = arguments.camera.empty() ? "A" : arguments.camera,
                          .socket = arguments.socket,
                          .group = group_id(arguments.group),
                          .start_monotonic_ns = arguments.start_monotonic_ns,
                          .loop = arguments.loop,
                          .config = arguments.config,
                          .end = end_of(arguments)},
                         g_asked_to_end));
}

/// Into a folder instead of shared memory: no daemon reads it.
int write_folder(const GrabArguments& arguments) {
  const std::size_t written = write_dicom_folder({.run = arguments.dicom,
                                                  .rate_hz = arguments.rate_hz,
                                                  .camera = arguments.camera,
                                                  .config = arguments.config,
                                                  .coils = arguments.coils,
                                                  .at_s = arguments.at_s.value_or(0),
                                                  .into = arguments.into});
  std::cerr << "tubectl: next: tubectl reconstruct " << arguments.into << " --out shapes.csv\n";
  return told(written);
}

int run_grab(const GrabArguments& arguments, const DriverSettings& video) {
  const std::initializer_list<const std::string*> sources{&arguments.folder, &arguments.video,
                                                          &arguments.dicom};
  if (std::count_if(sources.begin(), sources.end(), [](const auto* given) { return !given->empty(); }) != 1) {
    refuse_usage("grab", "expected a SEQUENCE, --video or --dicom, one of them");
  }
  if (arguments.socket.empty() == arguments.into.empty()) {
    refuse_usage("grab", "expected --socket, or with --dicom --into, one of them");
  }
  if (!arguments.into.empty() && (arguments.dicom.empty() || arguments.coils.empty())) {
    refuse_usage("grab", "--into goes with --dicom and --coils");
  }
  if (arguments.into.empty() && (!arguments.coils.empty() || arguments.at_s)) {
    refuse_usage("grab", "--coils and --at go with --into");
  }
  if (!arguments.into.empty() && (arguments.loop || arguments.duration_s > 0 || !arguments.at_s)) {
    refuse_usage("grab",
                 "--into needs --at, the time of the first exposure, and takes neither --loop nor --seconds");
  }
  if (arguments.dicom.empty() && (!arguments.config.empty() || arguments.rate_hz > 0)) {
    refuse_usage("grab", "--config and --rate go with --dicom");
  }
  std::signal(SIGINT, [](int) { g_asked_to_end = 1; });
  std::signal(SIGTERM, [](int) { g_asked_to_end = 1; });
  try {
    if (!arguments.into.empty()) return write_folder(arguments);
    if (!arguments.dicom.empty()) return grab_run(arguments);
    return arguments.video.empty() ? grab(arguments) : grab_card(arguments, video);
  } catch (const std::exception& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_grab(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<GrabArguments>();
  CommandLine verb = app.add_subcommand(
      "grab",
      "Write the images of a capture card, of a DICOM run, or of a sequence folder, into shared memory in "
      "real time");
  verb.add_option("SEQUENCE", arguments->folder,
                  "Sequence folder, format 1: played as a frame grabber would");
  verb.add_option("--video", arguments->video, "Capture card or USB grabber, such as /dev/video0");
  verb.add_option("--dicom", arguments->dicom,
                  "Fluoroscopic run, XA or RF: a multi-frame file, or the folder of a series");
  verb.add_option("--rate", arguments->rate_hz, "With --dicom: images a second")
      .positive()
      .default_str("as the run says");
  verb.add_option(
          "--config", arguments->config,
          "With --dicom: configuration of the daemon; each image is sent with the pose that its angles "
          "give to the [camera.c_arm] there")
      .default_str("images without poses");
  verb.add_option("--socket", arguments->socket, "Path of the socket: `device` of the daemon's [[camera]]");
  verb.add_option("--into", arguments->into,
                  "With --dicom: no shared memory, but a sequence folder of the run and --coils, for tubectl "
                  "reconstruct");
  verb.add_option("--coils", arguments->coils, "With --into: sequence folder whose coils and room are taken");
  verb.add_option("--at", arguments->at_s,
                  "With --into: time of the run's first exposure among the coils', s");
  verb.add_option("--camera", arguments->camera,
                  "Camera of the sequence, or of the daemon that gets the images of card or run")
      .default_str("the sequence's first; A");
  verb.add_option("--group", arguments->group, "Group whose members may read").default_str("none");
  verb.add_option("--start-monotonic-ns", arguments->start_monotonic_ns,
                  "CLOCK_MONOTONIC at time 0 of the sequence")
      .default_str("in 300 ms");
  verb.add_option("--seconds", arguments->duration_s, "Stop after this time")
      .positive()
      .default_str("at the end");
  verb.add_flag("--loop", arguments->loop, "Begin again at the end");
  std::vector<KeyDescription> keys = v4l2_settings();
  std::erase_if(keys,
                [](const KeyDescription& key) { return key.name == "camera_of"; });  // no camera matrix here
  auto video = std::make_shared<SettingOptions>(verb, "With --video, as the keys of [v4l2]", keys);
  verb.callback([arguments, video, &exit_code] {
    exit_code = run_grab(*arguments, video->settings().with("camera_of", std::string("delivered")));
  });
  return verb;
}

}  // namespace tubed
