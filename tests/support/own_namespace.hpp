// Tests that use DDS run in a network of their own: including this file moves the test program, before main()
// and thus before any thread, into namespaces in which only a loopback interface exists. Without the
// privileges to do so tests derived from DdsTest skip and say why.
#pragma once

#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

namespace tubed {

/// Set in child processes that are to share their parent's network.
inline constexpr const char* kInNamespaceVariable = "TUBED_TEST_IN_NAMESPACE";

inline bool bring_loopback_up() {
  const int control = socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool is_up = control >= 0 && ioctl(control, SIOCSIFFLAGS, &request) == 0;
  close(control);
  return is_up;
}

/// Empty on success, otherwise why not.
inline std::string enter_own_namespace() {
  if (std::getenv(kInNamespaceVariable) != nullptr) {
    return "";
  }
  const int wanted = CLONE_NEWNET | CLONE_NEWNS | CLONE_NEWIPC;
  if (unshare(geteuid() == 0 ? wanted : wanted | CLONE_NEWUSER) != 0) {
    return std::string("no namespaces of its own (") + std::strerror(errno) +
           "): run as root or allow unprivileged user namespaces";
  }
  // A /dev/shm of its own where possible; DDS over loopback alone does not need it.
  if (mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0) {
    static_cast<void>(mount("tmpfs", "/dev/shm", "tmpfs", 0, nullptr));
  }
  setenv(kInNamespaceVariable, "1", 1);
  return bring_loopback_up() ? "" : std::string("cannot bring lo up: ") + std::strerror(errno);
}

inline const std::string kWhyNoNamespace = enter_own_namespace();

class DdsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!kWhyNoNamespace.empty()) {
      GTEST_SKIP() << "SKIPPED: " << kWhyNoNamespace;
    }
  }
};

}  // namespace tubed
