#include "clients/tubectl/see/demo_daemon.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "drivers/laboratory/room_mistakes.hpp"
#include "drivers/laboratory/scenario.hpp"
#include "drivers/laboratory/simulated_world.hpp"

namespace tubed {

namespace fs = std::filesystem;

namespace {

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "tubed-demo-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error("cannot make a folder in " + fs::temp_directory_path().string() + ": " +
                             std::strerror(errno));
  }
  return name;
}

/// Throws std::runtime_error with what to do when it is nowhere.
fs::path find_program(const std::string& name, const std::string& advice) {
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  std::vector<fs::path> candidates = {here / name, here.parent_path() / "sbin" / name};
  const char* path = std::getenv("PATH");
  std::string rest = path != nullptr ? path : "";
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    candidates.push_back(fs::path(rest.substr(0, colon)) / name);
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  for (const fs::path& candidate : candidates) {
    if (access(candidate.c_str(), X_OK) == 0) {
      return candidate;
    }
  }
  throw std::runtime_error("no " + name + " beside " + here.string() + ", in ../sbin or in PATH; " + advice);
}

fs::path port_in(const fs::path& folder) { return folder / "aurora"; }

std::string bus_of(const DemoScene& scene, const fs::path& folder) {
  return scene.can_interface.empty() ? (folder / "can.sock").string() : scene.can_interface;
}

/// Where a simulated source, or the emulated tracker, takes commands.
fs::path socket_in(const fs::path& folder, const std::string& source) { return folder / (source + ".sock"); }

std::string toml_number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.12f", value);
  return text.data();
}

std::string toml_matrix(const RigidTransform& transform) {
  std::string text = "[";
  for (int row = 0; row < 4; ++row) {
    text += row == 0 ? "[" : ", [";
    for (int column = 0; column < 4; ++column) {
      text += (column == 0 ? "" : ", ") + toml_number(transform.matrix()(row, column));
    }
    text += "]";
  }
  return text + "]";
}

/// One view of the arch from the front, five coils.
RoomDescription room_of_the_arch() {
  CameraCalibration camera{"A", 400, 600, 2000, 2000, 200, 300, {}, RigidTransform::Identity()};
  camera.T_camera_world.translation().z() = 1200;
  InstrumentDescription catheter;
  int sensor = 0;
  for (const double offset_mm : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    catheter.coils.push_back({++sensor, offset_mm, false});
  }
  RoomDescription room;
  room.cameras = {camera};
  room.instruments = {catheter};
  return room;
}

/// Views, registration and coils as they are described, mistakes and all.
RoomDescription room_of(const DemoScene& scene) {
  const RoomMistakes mistakes = parse_mistakes(scene.mistakes);
  if (scene.preset == kArchPreset) {
    return described_room(room_of_the_arch(), mistakes, {scene.seed, Eigen::Vector3d::Zero()});
  }
  const Scenario scenario = make_scenario(scene.preset, scene.seed);
  return described_room(scenario.room, mistakes, {scene.seed, scenario.middle_world_mm});
}

std::string instrument_text(const char* id, const char* mode, const std::vector<CoilPlacement>& coils,
                            DemoTracker tracker) {
  std::string text = std::string("[[instrument]]\nid = \"") + id + "\"\nmode = \"" + mode +
                     "\"\ndiameter_mm = 2.33\nlength_mm = 380.0\n";
  for (const CoilPlacement& coil : coils) {
    text += "[[instrument.coil]]\nsensor = " + std::to_string(coil.sensor) +
            "\noffset_from_tip_mm = " + toml_number(coil.offset_from_tip_mm) + "\n";
    if (tracker == DemoTracker::kAuroraSerial) {  // as the emulator plugs them in: two on a port
      text += "port = " + std::to_string((coil.sensor + 1) / 2) +
              "\nchannel = " + std::to_string((coil.sensor + 1) % 2) + "\n";
    }
  }
  return text + "\n";
}

}  // namespace

std::string demo_configuration(const DemoScene& scene, const fs::path& folder) {
  const RoomDescription room = room_of(scene);
  const bool serial = scene.tracker == DemoTracker::kAuroraSerial;
  const bool can = scene.tracker == DemoTracker::kAuroraCan;
  std::string text = "# Written by tubectl demo.\n[dds]\ndomain = " + std::to_string(scene.domain) + "\n\n";
  text += std::string("[em]\ndriver = \"") +
          (serial ? "aurora-serial"
           : can  ? "aurora-can"
                  : "simulation") +
          "\"\nT_world_em = " + toml_matrix(room.T_world_em) + "\n";
  text += serial ? "device = \"" + port_in(folder).string() + "\"\n\n"
          : can  ? "device = \"" + bus_of(scene, folder) + "\"\n\n"
                 : "\n";
  if (scene.shows_images) text += "[shm]\npreview_folder = \"" + folder.string() + "\"\n\n";
  for (const CameraCalibration& camera : room.cameras) {
    text += "[[camera]]\nname = \"" + camera.name + "\"\nwidth = " + std::to_string(camera.width) +
            "\nheight = " + std::to_string(camera.height) + "\nfx = " + toml_number(camera.fx) +
            "\nfy = " + toml_number(camera.fy) + "\ncx = " + toml_number(camera.cx) +
            "\ncy = " + toml_number(camera.cy) +
            "\ndistortion = [0, 0, 0, 0, 0]\nT_camera_world = " + toml_matrix(camera.T_camera_world) +
            "\ndriver = \"simulation\"\n\n";
  }
  const std::vector<CoilPlacement>& coils = room.instruments.front().coils;
  text += instrument_text("cath-1", "filter", coils, scene.tracker) +
          instrument_text("cath-1-em", "em", coils, scene.tracker);
  text += "[simulation]\npreset = \"" + scene.preset + "\"\nseed = " + std::to_string(scene.seed) +
          "\nepoch_ns = " + std::to_string(scene.epoch_ns) + "\ncontrol_folder = \"" + folder.string() +
          "\"\n";
  if (!scene.mistakes.empty()) {
    text += "mistakes = \"";
    for (const std::string& word : scene.mistakes) text += (word == scene.mistakes.front() ? "" : " ") + word;
    text += "\"\n";
  }
  return text;
}

DemoDaemon::DemoDaemon(const DemoScene& scene)
    : folder_(new_folder()), configuration_(demo_configuration(scene, folder_.path)) {
  const fs::path program = find_program("tubed", "build it with ./run build");
  const fs::path file = folder() / "tubed.toml";
  std::ofstream(file) << configuration_;
  const std::string tubectl = fs::read_symlink("/proc/self/exe").string();
  const bool can = scene.tracker == DemoTracker::kAuroraCan;
  if (can || scene.tracker == DemoTracker::kAuroraSerial) {
    tracker_.emplace(
        std::vector<std::string>{tubectl, "aurora-emulator", "--config", file.string(), "--link",
                                 port_in(folder()).string(), "--control", socket_in(folder(), "em").string()},
        folder() / "tracker.log");
    if (can) {
      gateway_.emplace(
          std::vector<std::string>{tubectl, "can-gateway", "--serial", port_in(folder()).string(), "--can",
                                   bus_of(scene, folder()), "--layout", scene.can_layout},
          folder() / "gateway.log");
    }
  }
  daemon_.emplace(std::vector<std::string>{program.string(), "--config", file.string()},
                  folder() / "tubed.log");
  if (!scene.web.empty()) start_view(scene);
}

void DemoDaemon::start_view(const DemoScene& scene) {
  const fs::path program =
      find_program("tubed-view", "build it with ./run demo --web or ./run build; it needs libturbojpeg0-dev");
  std::vector<std::string> command{
      program.string(), "--listen",        scene.web,       "--domain",       std::to_string(scene.domain),
      "--images",       folder().string(), "--demo-folder", folder().string()};
  command.insert(command.end(), scene.web_options.begin(), scene.web_options.end());
  for (const CameraCalibration& camera : room_of(scene).cameras) {
    command.insert(command.end(), {"--demo-camera", camera.name});
  }
  view_.emplace(command, folder() / "view.log");
}

std::optional<EndedProgram> DemoDaemon::ended(std::size_t lines) {
  if (tracker_ && !tracker_->is_running()) {
    return EndedProgram{"the emulated tracker", tracker_->log_tail(lines)};
  }
  if (gateway_ && !gateway_->is_running()) {
    return EndedProgram{"the gateway", gateway_->log_tail(lines)};
  }
  if (view_ && !view_->is_running()) {
    return EndedProgram{"tubed-view", view_->log_tail(lines)};
  }
  if (!daemon_->is_running()) {
    return EndedProgram{"tubed", daemon_->log_tail(lines)};
  }
  return std::nullopt;
}

DemoFolder::~DemoFolder() {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

bool DemoDaemon::command(const std::string& source, const std::string& words) const {
  const std::string path = socket_in(folder(), source).string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    return false;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) {
    return false;
  }
  const ssize_t sent = sendto(descriptor, words.data(), words.size(), MSG_DONTWAIT,
                              reinterpret_cast<const sockaddr*>(&address), sizeof address);
  close(descriptor);
  return sent == static_cast<ssize_t>(words.size());
}

}  // namespace tubed
