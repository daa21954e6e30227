// tubectl grab: a frame grabber made of a sequence folder, or of a capture card; writes its images into
// shared memory in real time.
#include <grp.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "clients/tubectl/run/grab_video.hpp"
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
  std::string video;   // device; empty: the folder is played
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

template <std::size_t count>
void copy_to(float (&to)[count], const std::array<double, count>& from) {
  std::transform(from.begin(), from.end(), to, [](double value) { return static_cast<float>(value); });
}

void describe(const ViewGeometry& geometry, tubed_shm_image& described) {
  described.geometry = TUBED_SHM_GEOMETRY;
  described.fx = static_cast<float>(geometry.fx);
  described.fy = static_cast<float>(geometry.fy);
  described.cx = static_cast<float>(geometry.cx);
  described.cy = static_cast<float>(geometry.cy);
  copy_to(described.q_camera_world, geometry.q_camera_world);
  copy_to(described.t_camera_world_mm, geometry.t_camera_world_mm);
  copy_to(described.sigma_rotation_rad, geometry.sigma.rotation_rad);
  copy_to(described.sigma_translation_mm, geometry.sigma.translation_mm);
  described.pivot_depth_mm = static_cast<float>(geometry.sigma.pivot_depth_mm);
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
  if (row.geometry) {
    describe(*row.geometry, described);
  }
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
  return told(write_all(view, playhead_over(view.rows, folder, settings), writer, end_of(arguments)));
}

int run_grab(const GrabArguments& arguments, const DriverSettings& video) {
  if (arguments.folder.empty() == arguments.video.empty()) {
    refuse_usage("grab", "expected a SEQUENCE or --video");
  }
  std::signal(SIGINT, [](int) { g_asked_to_end = 1; });
  std::signal(SIGTERM, [](int) { g_asked_to_end = 1; });
  try {
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
      "grab", "Write the images of a capture card, or of a sequence folder, into shared memory in real time");
  verb.add_option("SEQUENCE", arguments->folder,
                  "Sequence folder, format 1: played as a frame grabber would");
  verb.add_option("--video", arguments->video, "Capture card or USB grabber, such as /dev/video0");
  verb.add_option("--socket", arguments->socket, "Path of the socket: `device` of the daemon's [[camera]]")
      .required();
  verb.add_option("--camera", arguments->camera,
                  "Camera of the sequence, or of the daemon that gets the card's images")
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
