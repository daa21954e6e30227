// tubectl grab: a frame grabber made of a sequence folder; writes its images into shared memory in real time.
#include <grp.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/replay_driver.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {
namespace {

struct GrabArguments {
  std::string folder;
  std::string camera;  // empty: the first
  std::string socket;
  std::string group;
  std::int64_t start_monotonic_ns = 0;
  double duration_s = 0;  // 0: to the end of the sequence
  bool loop = false;
};

volatile std::sig_atomic_t g_asked_to_end = 0;

std::size_t camera_index(const Sequence& sequence, const std::string& name) {
  const auto& cameras = sequence.room.cameras;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (name.empty() || cameras[i].name == name) {
      return i;
    }
  }
  throw std::runtime_error(sequence.folder.string() + " has no camera '" + name + "'");
}

std::unique_ptr<ImageSource> open_source(const Sequence& sequence, std::size_t camera,
                                         const GrabArguments& arguments) {
  const DriverSettings settings({{"folder", arguments.folder},
                                 {"loop", arguments.loop},
                                 {"start_monotonic_ns", arguments.start_monotonic_ns},
                                 {"memory_limit_mb", std::int64_t{2048}}});
  auto source = make_replay_image_source(sequence.room, settings, static_cast<int>(camera));
  const OpenResult opened = source->open();
  if (!opened.ok) {
    throw std::runtime_error(opened.why);
  }
  return source;
}

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

/// As the recording has them: the exposure is when the sequence says, and no setting makes a device of it.
tubed_shm_image image_of(const ImageFrame& frame) {
  tubed_shm_image image{};
  image.exposure_ns = to_ns(frame.exposure);
  image.frame_number = frame.frame_number;
  image.origin = TUBED_SHM_REPLAYED;
  image.fluoroscopy_on = frame.fluoroscopy_on ? 1 : 0;
  image.depth_bits = frame.depth == PixelDepth::kGrey8 ? 8 : 16;
  image.width = static_cast<std::uint32_t>(frame.width);
  image.height = static_cast<std::uint32_t>(frame.height);
  return image;
}

int grab(const GrabArguments& arguments) {
  const Sequence sequence = read_sequence(arguments.folder);
  const std::size_t camera = camera_index(sequence, arguments.camera);
  const CameraCalibration& calibration = sequence.room.cameras[camera];
  const auto source = open_source(sequence, camera, arguments);
  ShmImageWriter writer({.socket = arguments.socket,
                         .camera = calibration.name,
                         .most_width = static_cast<std::uint32_t>(calibration.width),
                         .most_height = static_cast<std::uint32_t>(calibration.height),
                         .most_depth_bits = 16,
                         .group = group_id(arguments.group)});
  std::cerr << "tubectl: camera " << calibration.name << ' ' << calibration.width << " x "
            << calibration.height << " at " << arguments.socket << '\n';
  ImageFrame frame;
  frame.reserve(calibration.width, calibration.height);
  const MonotonicTime started = monotonic_now();
  std::uint64_t written = 0;
  while (g_asked_to_end == 0 &&
         (arguments.duration_s == 0 || seconds_between(started, monotonic_now()) < arguments.duration_s)) {
    const ReadOutcome outcome = source->read(frame, monotonic_now() + std::chrono::milliseconds(50));
    if (outcome == ReadOutcome::kFrame) {
      written += writer.put(image_of(frame), frame.pixels.data()) ? 1 : 0;
    } else if (outcome == ReadOutcome::kTimeout) {
      writer.beat();
    } else {
      break;
    }
  }
  std::cerr << "tubectl: " << written << " images written\n";
  return written > 0 ? kExitOk : kExitFailed;
}

int run_grab(const GrabArguments& arguments) {
  std::signal(SIGINT, [](int) { g_asked_to_end = 1; });
  std::signal(SIGTERM, [](int) { g_asked_to_end = 1; });
  try {
    return grab(arguments);
  } catch (const std::exception& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CLI::App* add_grab(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<GrabArguments>();
  CLI::App* verb = app.add_subcommand(
      "grab", "Write a sequence folder's images into shared memory in real time, as a frame grabber would");
  verb->add_option("SEQUENCE", arguments->folder, "Sequence folder, format 1")->required();
  verb->add_option("--socket", arguments->socket, "Path of the socket: `device` of the daemon's [[camera]]")
      ->required();
  verb->add_option("--camera", arguments->camera, "Camera of the sequence")->default_str("its first");
  verb->add_option("--group", arguments->group, "Group whose members may read")->default_str("none");
  verb->add_option("--start-monotonic-ns", arguments->start_monotonic_ns,
                   "CLOCK_MONOTONIC at time 0 of the sequence")
      ->default_str("in 300 ms");
  verb->add_option("--seconds", arguments->duration_s, "Stop after this time")
      ->check(CLI::PositiveNumber)
      ->default_str("at the end");
  verb->add_flag("--loop", arguments->loop, "Begin again at the end");
  verb->callback([arguments, &exit_code] { exit_code = run_grab(*arguments); });
  return verb;
}

}  // namespace tubed
