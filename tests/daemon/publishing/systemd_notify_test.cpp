#include "daemon/publishing/systemd_notify.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace tubed {
namespace {

using std::chrono::milliseconds;
using TimePoint = std::chrono::steady_clock::time_point;

/// The service manager's end: a datagram socket with an abstract name.
class Listener {
 public:
  Listener() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(sa_family_t)), 0);
    socklen_t length = sizeof address;
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length);
    name_ = "@" + std::string(address.sun_path + 1, length - sizeof(sa_family_t) - 1);
  }
  ~Listener() { close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }

  /// The next message; empty when none has come.
  [[nodiscard]] std::string take() const {
    std::array<char, 512> text{};
    const ssize_t length = recv(socket_, text.data(), text.size(), 0);
    return length > 0 ? std::string(text.data(), static_cast<std::size_t>(length)) : "";
  }

 private:
  int socket_;
  std::string name_;
};

TEST(SystemdNotify, IsReadyWithTheFirstEstimateAndNotBefore) {
  Listener manager;
  SystemdNotify notify({manager.name(), {}});

  notify.status("cath-1 NOT_AVAILABLE");
  EXPECT_EQ(manager.take(), "STATUS=cath-1 NOT_AVAILABLE");
  EXPECT_EQ(manager.take(), "");

  notify.estimate_published(TimePoint(milliseconds(1)));
  notify.estimate_published(TimePoint(milliseconds(34)));
  EXPECT_EQ(manager.take(), "READY=1");
  EXPECT_EQ(manager.take(), "");
}

TEST(SystemdNotify, EstimatesFeedTheWatchdogFourTimesWithinItsTimeout) {
  Listener manager;
  SystemdNotify notify({manager.name(), milliseconds(2000)});
  for (int ms = 0; ms < 2000; ms += 20) {
    notify.estimate_published(TimePoint(milliseconds(10'000 + ms)));
  }
  EXPECT_EQ(manager.take(), "READY=1");
  int feedings = 0;
  while (manager.take() == "WATCHDOG=1") ++feedings;
  EXPECT_EQ(feedings, 4);
}

TEST(SystemdNotify, NothingButEstimatesFeedsTheWatchdog) {
  Listener manager;
  SystemdNotify notify({manager.name(), milliseconds(2000)});
  notify.status("a");
  notify.status("b");
  notify.reloading(TimePoint(milliseconds(5)));
  notify.reloaded();
  notify.stopping();
  for (std::string message = manager.take(); !message.empty(); message = manager.take()) {
    EXPECT_EQ(message.find("WATCHDOG"), std::string::npos) << message;
  }
}

TEST(SystemdNotify, SaysAStatusOnceAndOnOneLine) {
  Listener manager;
  SystemdNotify notify({manager.name(), {}});
  notify.status("one\ntwo");
  notify.status("one\ntwo");
  EXPECT_EQ(manager.take(), "STATUS=one two");
  EXPECT_EQ(manager.take(), "");
}

TEST(SystemdNotify, ReloadingCarriesTheTimeItBegan) {
  Listener manager;
  SystemdNotify notify({manager.name(), {}});
  notify.reloading(TimePoint(std::chrono::microseconds(123'456'789)));
  EXPECT_EQ(manager.take(), "RELOADING=1\nMONOTONIC_USEC=123456789");
}

TEST(SystemdNotify, WithoutAServiceManagerNothingIsSent) {
  SystemdNotify nobody({"", milliseconds(100)});
  nobody.estimate_published(TimePoint(milliseconds(1)));
  SystemdNotify gone({"/nowhere/notify", milliseconds(100)});
  gone.estimate_published(TimePoint(milliseconds(1)));
  SystemdNotify too_long({"/" + std::string(300, 'x'), {}});
  too_long.stopping();
}

TEST(ServiceManager, AWatchdogForAnotherProcessIsNotOurs) {
  setenv("WATCHDOG_USEC", "2000000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(service_manager_of_environment().watchdog);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  EXPECT_EQ(service_manager_of_environment().watchdog, std::chrono::seconds(2));
  setenv("WATCHDOG_USEC", "soon", 1);
  EXPECT_FALSE(service_manager_of_environment().watchdog);
  unsetenv("WATCHDOG_USEC");
  unsetenv("WATCHDOG_PID");
}

}  // namespace
}  // namespace tubed
