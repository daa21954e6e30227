#include "drivers/laboratory/aurora_emulator/control_socket.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <stdexcept>

namespace tubed::aurora::emulator {

ControlSocket::ControlSocket(const std::filesystem::path& path) : path_(path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.string().size() >= sizeof(address.sun_path)) {
    throw std::runtime_error("control socket " + path.string() +
                             ": the path is too long for a socket; choose a shorter one");
  }
  path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  ::unlink(path.c_str());
  if (socket_ < 0 || ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) {
      ::close(socket_);
    }
    throw std::runtime_error("control socket " + path.string() + ": " + why +
                             "; does its folder exist and may it be written?");
  }
}

ControlSocket::~ControlSocket() {
  ::close(socket_);
  ::unlink(path_.c_str());
}

std::optional<std::string> ControlSocket::receive(std::string& sender) {
  std::array<char, 256> command{};
  sockaddr_un address{};
  socklen_t size = sizeof(address);
  const ssize_t length = ::recvfrom(socket_, command.data(), command.size(), MSG_DONTWAIT,
                                    reinterpret_cast<sockaddr*>(&address), &size);
  if (length < 0) {
    return std::nullopt;
  }
  if (size > offsetof(sockaddr_un, sun_path)) {
    sender.assign(reinterpret_cast<const char*>(&address), size);
  }
  return std::string(command.data(), static_cast<std::size_t>(length));
}

void ControlSocket::answer(const std::string& sender, const std::string& why) const {
  if (sender.empty()) {
    return;
  }
  const std::string text = why.empty() ? "done" : why;
  // A sender that does not wait for its answer misses it.
  (void)::sendto(socket_, text.data(), text.size(), MSG_DONTWAIT,
                 reinterpret_cast<const sockaddr*>(sender.data()), static_cast<socklen_t>(sender.size()));
}

}  // namespace tubed::aurora::emulator
