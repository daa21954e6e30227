#include "clients/tubectl/demo_daemon.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "drivers/simulation/scenario.hpp"

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

fs::path find_tubed() {
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  std::vector<fs::path> candidates = {here / "tubed", here.parent_path() / "sbin" / "tubed"};
  const char* path = std::getenv("PATH");
  std::string rest = path != nullptr ? path : "";
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    candidates.push_back(fs::path(rest.substr(0, colon)) / "tubed");
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  for (const fs::path& candidate : candidates) {
    if (access(candidate.c_str(), X_OK) == 0) {
      return candidate;
    }
  }
  throw std::runtime_error("no tubed beside " + here.string() +
                           ", in ../sbin or in PATH; build it with ./run build");
}

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

/// Views and registration: those of the preset, or one view of the arch from the front.
RoomDescription room_of(const DemoScene& scene) {
  if (scene.preset != "arch") {
    return make_scenario(scene.preset, scene.seed).room;
  }
  CameraCalibration camera{"A", 400, 600, 2000, 2000, 200, 300, {}, RigidTransform::Identity()};
  camera.T_camera_world.translation().z() = 1200;
  RoomDescription room;
  room.cameras = {camera};
  return room;
}

[[noreturn]] void become_daemon(const fs::path& program, const fs::path& configuration, const fs::path& log) {
  // The daemon must not outlive a demonstration that was killed.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  dup2(file, STDOUT_FILENO);
  dup2(file, STDERR_FILENO);
  setsid();
  execl(program.c_str(), program.c_str(), "--config", configuration.c_str(), static_cast<char*>(nullptr));
  _exit(127);
}

}  // namespace

std::string demo_configuration(const DemoScene& scene, const fs::path& folder) {
  const RoomDescription room = room_of(scene);
  std::string text = "# Written by tubectl demo.\n[dds]\ndomain = " + std::to_string(scene.domain) + "\n\n";
  text += "[em]\ndriver = \"simulation\"\nT_world_em = " + toml_matrix(room.T_world_em) + "\n\n";
  for (const CameraCalibration& camera : room.cameras) {
    text += "[[camera]]\nname = \"" + camera.name + "\"\nwidth = " + std::to_string(camera.width) +
            "\nheight = " + std::to_string(camera.height) + "\nfx = " + toml_number(camera.fx) +
            "\nfy = " + toml_number(camera.fy) + "\ncx = " + toml_number(camera.cx) +
            "\ncy = " + toml_number(camera.cy) +
            "\ndistortion = [0, 0, 0, 0, 0]\nT_camera_world = " + toml_matrix(camera.T_camera_world) +
            "\ndriver = \"simulation\"\n\n";
  }
  for (const bool em_only : {false, true}) {
    text += std::string("[[instrument]]\nid = \"cath-1") + (em_only ? "-em" : "") + "\"\nmode = \"" +
            (em_only ? "em" : "filter") + "\"\ndiameter_mm = 2.33\nlength_mm = 380.0\n";
    int sensor = 0;
    for (const char* offset : {"10.0", "90.0", "170.0", "270.0", "370.0"}) {
      text += "[[instrument.coil]]\nsensor = " + std::to_string(++sensor) +
              "\noffset_from_tip_mm = " + offset + "\n";
    }
    text += "\n";
  }
  text += "[simulation]\npreset = \"" + scene.preset + "\"\nseed = " + std::to_string(scene.seed) +
          "\nepoch_ns = " + std::to_string(scene.epoch_ns) + "\ncontrol_folder = \"" + folder.string() +
          "\"\n";
  return text;
}

DemoDaemon::DemoDaemon(const DemoScene& scene) : folder_(new_folder()) {
  const fs::path program = find_tubed();
  configuration_ = demo_configuration(scene, folder_);
  const fs::path file = folder_ / "tubed.toml";
  std::ofstream(file) << configuration_;
  process_ = fork();
  if (process_ < 0) {
    throw std::runtime_error(std::string("cannot start tubed: ") + std::strerror(errno));
  }
  if (process_ == 0) {
    become_daemon(program, file, folder_ / "tubed.log");
  }
}

DemoDaemon::~DemoDaemon() {
  if (process_ > 0) {
    kill(process_, SIGTERM);
    int status = 0;
    for (int tries = 0; tries < 300 && waitpid(process_, &status, WNOHANG) == 0; ++tries) {
      usleep(10'000);
      if (tries == 200) {
        kill(process_, SIGKILL);
      }
    }
  }
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

bool DemoDaemon::is_running() {
  int status = 0;
  if (process_ > 0 && waitpid(process_, &status, WNOHANG) == process_) {
    process_ = -1;
  }
  return process_ > 0;
}

bool DemoDaemon::command(const std::string& source, const std::string& words) const {
  const std::string path = (folder_ / (source + ".sock")).string();
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

std::vector<std::string> DemoDaemon::log_tail(std::size_t lines) const {
  std::vector<std::string> all;
  std::ifstream log(folder_ / "tubed.log");
  for (std::string line; std::getline(log, line);) {
    all.push_back(line);
  }
  if (all.size() > lines) {
    all.erase(all.begin(), all.end() - static_cast<std::ptrdiff_t>(lines));
  }
  return all;
}

}  // namespace tubed
