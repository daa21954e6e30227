// What the daemon tells the service manager: sd_notify(3)'s protocol, one datagram a message. Written here
// because libsystemd would bring four compression libraries into a process whose memory is locked.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tubed {

/// What a service manager left in the environment; nothing when there is none.
struct ServiceManager {
  std::string socket;                                 ///< NOTIFY_SOCKET: a path, or @name; empty = none
  std::optional<std::chrono::microseconds> watchdog;  ///< WATCHDOG_USEC, when it is meant for this process
};

/// NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID as systemd sets them. A number that is none counts as
/// absent.
ServiceManager service_manager_of_environment();

/// Sends without ever waiting: a message that cannot be sent is lost, and without a service manager nothing
/// is sent. The reload and stopping words come from the main thread, the others from the publisher's; no
/// member that changes is used by both.
class SystemdNotify {
 public:
  explicit SystemdNotify(ServiceManager manager = service_manager_of_environment());
  ~SystemdNotify();
  SystemdNotify(const SystemdNotify&) = delete;
  SystemdNotify& operator=(const SystemdNotify&) = delete;

  /// An estimate has left the process at `now`, CLOCK_MONOTONIC: the first one makes the service ready, and
  /// each feeds the watchdog, at most four times within its timeout. Nothing else does.
  void estimate_published(std::chrono::steady_clock::time_point now);

  /// STATUS=, when the words are others than last time. Line breaks become blanks.
  void status(std::string_view words);

  /// Between these two a reload is going on. `monotonic`: CLOCK_MONOTONIC at its beginning.
  void reloading(std::chrono::steady_clock::time_point monotonic) const;
  void reloaded() const;
  /// The daemon is ending.
  void stopping() const;

 private:
  void send(std::string_view message) const;

  ServiceManager manager_;
  int socket_ = -1;
  bool is_ready_ = false;                                 ///< of the publisher's thread
  std::chrono::steady_clock::time_point next_feeding_{};  ///< of the publisher's thread
  std::string status_;                                    ///< of the publisher's thread
};

}  // namespace tubed
