// tubectl grab: a frame grabber made of a sequence folder; writes its images into shared memory in real time.
#include <grp.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead_over.hpp"
#include "drivers/replay/replayed_folder.hpp"

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

constexpr std::int64_t kMemoryLimitMb = 2048;
constexpr std::chrono::milliseconds kBeat{50};

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

/// As the recording has them: the exposure is when the sequence says, and no setting makes a device of it.
tubed_shm_image image_of(const SequenceFrame& row, const GreyImage& image, const Playhead& playhead,
                         std::uint32_t numbers_a_lap) {
  tubed_shm_image described{};
  described.exposure_ns = to_ns(playhead.due());
  described.frame_number = row.frame + playhead.lap() * numbers_a_lap;
  described.origin = TUBED_SHM_REPLAYED;
  described.fluoroscopy_on = row.fluoroscopy_on() ? 1 : 0;
  described.depth_bits = image.depth == PixelDepth::kGrey8 ? 8 : 16;
  described.width = static_cast<std::uint32_t>(image.width);
  described.height = static_cast<std::uint32_t>(image.height);
  return described;
}

bool is_asked_to_end(MonotonicTime end) { return g_asked_to_end != 0 || monotonic_now() >= end; }

/// Each image when it is due, copied once, from the decoded recording into the shared memory. How many.
std::uint64_t write_all(const ReplayedView& view, Playhead playhead, ShmImageWriter& writer,
                        MonotonicTime end) {
  std::uint32_t numbers_a_lap = 1;
  for (const SequenceFrame& row : view.rows) {
    numbers_a_lap = std::max(numbers_a_lap, row.frame + 1);
  }
  std::uint64_t written = 0;
  while (!playhead.ended() && !is_asked_to_end(end)) {
    if (!sleep_until(playhead.due(), monotonic_now() + kBeat)) {
      writer.beat();
      continue;
    }
    playhead.skip_overtaken(monotonic_now());
    const GreyImage& image = view.images[playhead.row()];
    const tubed_shm_image described = image_of(view.rows[playhead.row()], image, playhead, numbers_a_lap);
    written += writer.put(described, image.pixels.data()) ? 1 : 0;
    playhead.advance();
  }
  return written;
}

int grab(const GrabArguments& arguments) {
  const std::string camera = arguments.camera.empty() ? first_camera(arguments.folder) : arguments.camera;
  FolderLease lease(arguments.folder, camera);
  const ReplayedFolder& folder = lease.open(kMemoryLimitMb);
  const CameraCalibration& calibration = folder.sequence.room.cameras[index_of(folder, camera)];
  const ReplayedView& view = folder.views[index_of(folder, camera)];
  ShmImageWriter writer({.socket = arguments.socket,
                         .camera = camera,
                         .most_width = static_cast<std::uint32_t>(calibration.width),
                         .most_height = static_cast<std::uint32_t>(calibration.height),
                         .most_depth_bits = 16,
                         .group = group_id(arguments.group)});
  const DriverSettings settings(
      {{"loop", arguments.loop}, {"start_monotonic_ns", arguments.start_monotonic_ns}});
  std::cerr << "tubectl: camera " << camera << ' ' << calibration.width << " x " << calibration.height
            << " at " << arguments.socket << '\n';
  const MonotonicTime end = arguments.duration_s == 0
                                ? MonotonicTime::max()
                                : monotonic_now() + to_nanoseconds(arguments.duration_s);
  const std::uint64_t written = write_all(view, playhead_over(view.rows, folder, settings), writer, end);
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
