#include "drivers/aurora_can/can_local_bus.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tubed {

namespace {

constexpr int kOn = 1;
constexpr mode_t kUserAndGroup = 0660;

int new_socket() noexcept { return ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0); }

/// False when the path is too long for a socket.
bool fill(sockaddr_un& address, const std::string& path) noexcept {
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    return false;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return true;
}

const sockaddr* generic(const sockaddr_un& address) noexcept {
  return reinterpret_cast<const sockaddr*>(&address);
}

int close_after_error(int descriptor) noexcept {
  const int error = errno;
  ::close(descriptor);
  return -error;
}

/// Somebody else's words are the same at both ends.
std::string_view describe_path_error(int error) noexcept {
  switch (error) {
    case EACCES:
    case EPERM:
      return "may not be used: only the user and the group of the gateway may";
    case ENAMETOOLONG:
      return "is too long a path for a socket: 107 characters at the most";
    case ENOTSOCK:
      return "is there and is no socket: name another path";
    default:
      return "does not work";
  }
}

/// A socket that a gateway has left behind without ending well goes; anything else stays.
int remove_left_behind(const sockaddr_un& address) noexcept {
  struct stat found {};
  if (::stat(address.sun_path, &found) != 0) {
    return 0;
  }
  if (!S_ISSOCK(found.st_mode)) {
    return ENOTSOCK;
  }
  const int probe = new_socket();
  const bool answers = probe >= 0 && ::connect(probe, generic(address), sizeof address) == 0;
  const bool is_busy = !answers && errno == EAGAIN;
  if (probe >= 0) {
    ::close(probe);
  }
  if (answers || is_busy) {
    return EADDRINUSE;
  }
  return ::unlink(address.sun_path) == 0 ? 0 : errno;
}

}  // namespace

int LocalBusReceiver::connect() noexcept {
  sockaddr_un address{};
  if (!fill(address, path_)) {
    return -ENAMETOOLONG;
  }
  const int descriptor = new_socket();
  if (descriptor < 0) {
    return -errno;
  }
  ::setsockopt(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &kOn, sizeof kOn);
  return ::connect(descriptor, generic(address), sizeof address) == 0 ? descriptor
                                                                      : close_after_error(descriptor);
}

std::string_view LocalBusReceiver::describe(int error) const noexcept {
  switch (error) {
    case ENOENT:
    case ECONNREFUSED:
      return "is not there: start `tubectl can-gateway --can PATH`, or see em.device";
    case ENODEV:
    case ECONNRESET:
      return "has gone: the gateway has ended";
    case EAGAIN:
      return "has a receiver already";
    case EPROTOTYPE:
      return "is another program's socket: see em.device";
    default:
      return describe_path_error(error);
  }
}

LocalBusSender::~LocalBusSender() {
  if (listener_ >= 0) {
    ::close(listener_);
    ::unlink(path_.c_str());
  }
}

int LocalBusSender::listen() noexcept {
  sockaddr_un address{};
  if (!fill(address, path_)) {
    return -ENAMETOOLONG;
  }
  if (const int error = remove_left_behind(address); error != 0) {
    return -error;
  }
  const int descriptor = new_socket();
  if (descriptor < 0) {
    return -errno;
  }
  const mode_t before = ::umask(static_cast<mode_t>(~kUserAndGroup & 0777U));
  const bool is_bound = ::bind(descriptor, generic(address), sizeof address) == 0;
  ::umask(before);
  return is_bound && ::listen(descriptor, 1) == 0 ? descriptor : close_after_error(descriptor);
}

int LocalBusSender::connect() noexcept {
  if (listener_ < 0) {
    const int listener = listen();
    if (listener < 0) {
      return listener;
    }
    listener_ = listener;
  }
  const int descriptor = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (descriptor >= 0) {
    return descriptor;
  }
  return errno == EAGAIN ? -ENOTCONN : -errno;
}

std::string_view LocalBusSender::describe(int error) const noexcept {
  switch (error) {
    case ENOTCONN:
    case EPIPE:
    case ECONNRESET:
      return "has no receiver";
    case ENOENT:
      return "cannot be made: its folder is not there";
    case EADDRINUSE:
      return "belongs to another gateway that still runs";
    case ENOBUFS:
      return "is full: its receiver does not read";
    default:
      return describe_path_error(error);
  }
}

std::unique_ptr<CanPort> make_can_port(const std::string& device, CanUse use, int receive_buffer,
                                       aurora::CanBase base) {
  if (device.find('/') == std::string::npos) {
    return std::make_unique<CanInterface>(device, use, receive_buffer, base);
  }
  if (use == CanUse::kReceive || use == CanUse::kListen) {
    return std::make_unique<LocalBusReceiver>(device);
  }
  return std::make_unique<LocalBusSender>(device);
}

}  // namespace tubed
