#include "daemon/publishing/systemd_notify.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace tubed {

namespace {

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

std::optional<std::int64_t> positive_number(std::string_view text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_number = error == std::errc() && end == text.data() + text.size() && number > 0;
  return is_number ? std::optional(number) : std::nullopt;
}

}  // namespace

ServiceManager service_manager_of_environment() {
  ServiceManager manager;
  manager.socket = variable("NOTIFY_SOCKET");
  const std::string_view meant_for = variable("WATCHDOG_PID");
  const bool is_meant_for_us = meant_for.empty() || positive_number(meant_for) == std::int64_t{getpid()};
  const auto timeout_us = positive_number(variable("WATCHDOG_USEC"));
  if (is_meant_for_us && timeout_us) {
    manager.watchdog = std::chrono::microseconds(*timeout_us);
  }
  return manager;
}

SystemdNotify::SystemdNotify(ServiceManager manager) : manager_(std::move(manager)) {
  const bool is_address = !manager_.socket.empty() &&
                          manager_.socket.size() < sizeof(sockaddr_un::sun_path) &&
                          (manager_.socket[0] == '/' || manager_.socket[0] == '@');
  if (is_address) {
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  }
}

SystemdNotify::~SystemdNotify() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

void SystemdNotify::estimate_published(std::chrono::steady_clock::time_point now) {
  if (!is_ready_) {
    is_ready_ = true;
    send("READY=1");
  }
  if (manager_.watchdog && now >= next_feeding_) {
    next_feeding_ = now + *manager_.watchdog / 4;
    send("WATCHDOG=1");
  }
}

void SystemdNotify::status(std::string_view words) {
  if (words == status_) {
    return;
  }
  status_ = words;
  std::string message = "STATUS=" + status_;
  std::replace(message.begin(), message.end(), '\n', ' ');
  send(message);
}

void SystemdNotify::reloading(std::chrono::steady_clock::time_point monotonic) const {
  const auto since_boot = std::chrono::duration_cast<std::chrono::microseconds>(monotonic.time_since_epoch());
  send("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(since_boot.count()));
}

void SystemdNotify::reloaded() const { send("READY=1"); }

void SystemdNotify::stopping() const { send("STOPPING=1\nSTATUS=ending"); }

void SystemdNotify::send(std::string_view message) const {
  if (socket_ < 0) {
    return;
  }
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, manager_.socket.data(), manager_.socket.size());
  const bool is_abstract = address.sun_path[0] == '@';
  if (is_abstract) {
    address.sun_path[0] = '\0';
  }
  // An abstract name has no end mark; a path counts with its own.
  const std::size_t length = offsetof(sockaddr_un, sun_path) + manager_.socket.size() + (is_abstract ? 0 : 1);
  sendto(socket_, message.data(), message.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address),
         static_cast<socklen_t>(length));
}

}  // namespace tubed
