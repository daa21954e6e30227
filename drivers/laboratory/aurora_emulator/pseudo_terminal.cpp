#include "drivers/laboratory/aurora_emulator/pseudo_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "drivers/laboratory/aurora_emulator/line_speed.hpp"

namespace tubed::aurora::emulator {

namespace {

[[noreturn]] void fail(const std::string& what, const std::string& help) {
  throw std::runtime_error(what + ": " + std::strerror(errno) + "; " + help);
}

/// No echo, no line editing, 9600 baud: nothing may come back before a driver has set the port itself.
void make_raw(const std::string& device) {
  const int slave = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  if (slave < 0 || ::tcgetattr(slave, &settings) != 0) {
    fail("pseudo-terminal " + device, "is /dev/pts mounted?");
  }
  ::cfmakeraw(&settings);
  ::cfsetspeed(&settings, B9600);
  ::tcsetattr(slave, TCSANOW, &settings);
  ::close(slave);
}

void link_to(const std::filesystem::path& link, const std::string& device) {
  if (link.empty()) {
    return;
  }
  std::error_code error;
  if (std::filesystem::is_symlink(link, error)) {
    std::filesystem::remove(link, error);
  }
  std::filesystem::create_symlink(device, link, error);
  if (error) {
    throw std::runtime_error("link " + link.string() + ": " + error.message() +
                             "; name a file that is not there, in a folder that may be written");
  }
}

}  // namespace

PseudoTerminal::PseudoTerminal(std::filesystem::path link) : link_(std::move(link)) {
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 128> name{};
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 ||
      ::ptsname_r(master_, name.data(), name.size()) != 0) {
    const int error = errno;
    close();
    errno = error;
    fail("no pseudo-terminal", "is /dev/ptmx there?");
  }
  device_ = name.data();
  try {
    make_raw(device_);
    link_to(link_, device_);
  } catch (...) {
    close();
    throw;
  }
}

PseudoTerminal::~PseudoTerminal() {
  std::error_code ignored;
  if (!link_.empty() && std::filesystem::read_symlink(link_, ignored) == device_) {
    std::filesystem::remove(link_, ignored);
  }
  close();
}

bool PseudoTerminal::in_use() const {
  pollfd state{master_, POLLIN, 0};
  return ::poll(&state, 1, 0) >= 0 && (state.revents & POLLHUP) == 0;
}

int PseudoTerminal::bits_per_second() const { return line_speed(master_); }

void PseudoTerminal::read(std::vector<std::uint8_t>& bytes) {
  std::array<std::uint8_t, 4096> chunk;
  ssize_t size = 0;
  while ((size = ::read(master_, chunk.data(), chunk.size())) > 0) {
    bytes.insert(bytes.end(), chunk.begin(), chunk.begin() + size);
  }
}

void PseudoTerminal::write(Bytes bytes) {
  if (!bytes.empty()) {
    [[maybe_unused]] const ssize_t written = ::write(master_, bytes.data(), bytes.size());
  }
}

void PseudoTerminal::close() noexcept {
  if (master_ >= 0) {
    ::close(std::exchange(master_, -1));
  }
}

}  // namespace tubed::aurora::emulator
