#include "drivers/simulation/fault_socket.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

namespace tubed {

namespace {

constexpr double kMaxStall_s = 1e6;
constexpr double kMaxOutlier_mm = 1e4;
constexpr double kMaxPan_mm = 200;

/// Takes the next word off the front of `rest`.
std::string_view take_word(std::string_view& rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
  const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r\n"));
  rest.remove_prefix(word.size());
  return word;
}

std::optional<double> take_number(std::string_view& rest, double least, double greatest) {
  const std::string_view word = take_word(rest);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool good =
      error == std::errc{} && end == word.data() + word.size() && value >= least && value <= greatest;
  return good ? std::optional(value) : std::nullopt;
}

std::optional<std::size_t> take_coil(std::string_view& rest) {
  const auto sensor = take_number(rest, 1, kMaxTrackerCoils);
  if (!sensor || *sensor != std::floor(*sensor)) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(*sensor) - 1;
}

bool stall(std::string_view rest, MonotonicTime now, Faults& faults) {
  const auto seconds = take_number(rest, 0, kMaxStall_s);
  if (seconds) {
    faults.stalled_until = now + std::chrono::nanoseconds(std::llround(*seconds * 1e9));
  }
  return seconds.has_value();
}

bool set_lost(std::string_view rest, bool lost, Faults& faults) {
  const auto coil = take_coil(rest);
  if (coil) {
    faults.lost[*coil] = lost;
  }
  return coil.has_value();
}

bool set_outlier(std::string_view rest, Faults& faults) {
  const auto coil = take_coil(rest);
  const auto distance_mm = take_number(rest, -kMaxOutlier_mm, kMaxOutlier_mm);
  if (!coil || !distance_mm) {
    return false;
  }
  faults.outlier_mm[*coil] = *distance_mm;
  return true;
}

bool pan(std::string_view rest, Faults& faults) {
  const auto distance_mm = take_number(rest, -kMaxPan_mm, kMaxPan_mm);
  faults.pan_mm = distance_mm.value_or(faults.pan_mm);
  return distance_mm.has_value();
}

OpenResult refused(const std::filesystem::path& path) {
  return {false, "control socket " + path.string() + ": " + std::strerror(errno) +
                     "; does control_folder exist and may it be written?"};
}

}  // namespace

bool apply_fault(std::string_view command, MonotonicTime now, Faults& faults) noexcept {
  const std::string_view verb = take_word(command);
  if (verb == "stall") {
    return stall(command, now, faults);
  }
  if (verb == "lose-coil" || verb == "restore-coil") {
    return set_lost(command, verb == "lose-coil", faults);
  }
  if (verb == "outlier") {
    return set_outlier(command, faults);
  }
  if (verb == "pan") {
    return pan(command, faults);
  }
  if (verb == "off" || verb == "on") {
    faults.fluoroscopy_off = verb == "off";
  } else if (verb == "black") {
    faults.black = true;
  } else if (verb == "stuck") {
    faults.stuck = true;
  } else if (verb == "clear") {
    faults = Faults{};
  } else {
    return false;
  }
  return true;
}

OpenResult FaultSocket::open(const std::filesystem::path& folder, const std::string& name) {
  close();
  const std::filesystem::path path = folder / name;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.string().size() >= sizeof(address.sun_path)) {
    return {false, "control socket " + path.string() +
                       ": the path is too long for a socket; choose a shorter control_folder"};
  }
  path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);

  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) {
    return refused(path);
  }
  ::unlink(path.c_str());
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    OpenResult result = refused(path);
    close();
    return result;
  }
  path_ = path;
  return {true, {}};
}

void FaultSocket::poll(MonotonicTime now, Faults& faults) noexcept {
  std::array<char, 128> command;
  while (socket_ >= 0) {
    const ssize_t length = ::recv(socket_, command.data(), command.size(), MSG_DONTWAIT);
    if (length < 0) {
      return;
    }
    apply_fault({command.data(), static_cast<std::size_t>(length)}, now, faults);
  }
}

void FaultSocket::close() noexcept {
  if (socket_ >= 0) {
    ::close(socket_);
    socket_ = -1;
  }
  if (!path_.empty()) {
    ::unlink(path_.c_str());
    path_.clear();
  }
}

}  // namespace tubed
