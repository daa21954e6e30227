#include "bench/support/own_network.hpp"

#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace tubed {

namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::runtime_error("cannot " + what + " (" + std::strerror(errno) +
                           "): it measures in a network of its own, so run it as root or allow unprivileged "
                           "user namespaces (sysctl kernel.unprivileged_userns_clone=1)");
}

/// In a user namespace of its own a user has to be told to be itself, or files cannot be made.
void remain_oneself(uid_t user, gid_t group) {
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/uid_map") << user << ' ' << user << " 1";
  std::ofstream("/proc/self/gid_map") << group << ' ' << group << " 1";
}

void bring_loopback_up() {
  const int control = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool is_up = control >= 0 && ioctl(control, SIOCSIFFLAGS, &request) == 0;
  close(control);
  if (!is_up) refuse("bring the loopback interface up");
}

/// A build folder below /tmp is hidden by the mount there: put it back, the programs beside this one are
/// needed.
void keep_in_sight(int folder, const std::filesystem::path& path) {
  if (!path.string().starts_with("/tmp/")) return;
  std::filesystem::create_directories(path);
  const std::string source = "/proc/self/fd/" + std::to_string(folder);
  if (mount(source.c_str(), path.c_str(), nullptr, MS_BIND, nullptr) != 0) refuse("keep " + path.string());
}

}  // namespace

void enter_own_network() {
  const int wanted = CLONE_NEWNET | CLONE_NEWNS | CLONE_NEWIPC;
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (unshare(user == 0 ? wanted : wanted | CLONE_NEWUSER) != 0) refuse("enter namespaces of its own");
  if (user != 0) remain_oneself(user, group);
  const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const int folder = open(programs.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  if (mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      mount("tmpfs", "/dev/shm", "tmpfs", 0, nullptr) != 0 ||
      mount("tmpfs", "/tmp", "tmpfs", 0, nullptr) != 0) {
    refuse("mount a /dev/shm and /tmp of its own");
  }
  keep_in_sight(folder, programs);
  close(folder);
  bring_loopback_up();
}

}  // namespace tubed
