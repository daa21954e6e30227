#include "drivers/aurora_serial/serial_port.hpp"

// The kernel's own declarations: those of <termios.h> know neither exact rates nor 921600 on every system,
// and cannot stand in the same file.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "drivers/interface/descriptor_wait.hpp"

namespace tubed {

namespace {

constexpr int kFirstRate = 9600;
constexpr std::chrono::milliseconds kWritePatience{200};
constexpr int kModemLines = TIOCM_DTR | TIOCM_RTS;

struct NamedRate {
  int bits_per_second;
  tcflag_t name;
};
constexpr NamedRate kNamedRates[] = {{9600, B9600},     {19200, B19200},   {38400, B38400},  {57600, B57600},
                                     {115200, B115200}, {230400, B230400}, {921600, B921600}};

template <typename Settings>
void make_raw(Settings& settings) noexcept {
  settings.c_iflag = IGNBRK;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
}

}  // namespace

int SerialPort::open() noexcept {
  if (is_open()) {
    return 0;
  }
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) {
    return errno;
  }
  int error = take_for_us();
  if (error == 0 && !configure(kFirstRate)) {
    error = errno == 0 ? EIO : errno;
  }
  if (error != 0) {
    close();
    return error;
  }
  ask_for_low_latency();
  ::ioctl(descriptor_, TIOCMBIS, &kModemLines);  // some adapters are powered by them; others have none
  ::ioctl(descriptor_, TCFLSH, TCIOFLUSH);
  return 0;
}

// TIOCEXCL keeps out programs that open the port later, but not those of root; the lock keeps out other
// drivers of ours.
int SerialPort::take_for_us() noexcept {
  termios settings{};
  if (::ioctl(descriptor_, TCGETS, &settings) != 0) {
    return ENOTTY;
  }
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    return EBUSY;
  }
  ::ioctl(descriptor_, TIOCEXCL);
  return 0;
}

void SerialPort::close() noexcept {
  if (is_open()) {
    ::ioctl(descriptor_, TIOCNXCL);
    ::close(std::exchange(descriptor_, -1));
  }
}

MonotonicTime SerialPort::now() noexcept { return monotonic_now(); }

bool SerialPort::write(aurora::Bytes bytes) noexcept {
  const MonotonicTime deadline = now() + kWritePatience;
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    } else if (written < 0 && errno == EAGAIN) {
      if (!wait_for(descriptor_, POLLOUT, deadline)) {
        return true;  // the line takes nothing: there will be no reply, which says it all
      }
    } else if (written == 0 || errno != EINTR) {
      return false;
    }
  }
  return true;
}

SerialPort::Arrival SerialPort::read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept {
  for (;;) {
    const ssize_t size = ::read(descriptor_, room.data(), room.size());
    if (size > 0) {
      return {static_cast<std::size_t>(size), false};
    }
    if (size == 0 || (errno != EAGAIN && errno != EINTR)) {
      return {0, true};  // a port that has been unplugged reads as its end, or fails
    }
    if (errno == EAGAIN && !wait_for(descriptor_, POLLIN, deadline)) {
      return {};
    }
  }
}

bool SerialPort::knows_baud(int bits_per_second) noexcept {
  termios2 before{};
  if (::ioctl(descriptor_, TCGETS2, &before) != 0) {
    return std::any_of(std::begin(kNamedRates), std::end(kNamedRates),
                       [&](const NamedRate& rate) { return rate.bits_per_second == bits_per_second; });
  }
  termios2 asked = before;
  asked.c_cflag = (asked.c_cflag & ~static_cast<tcflag_t>(CBAUD)) | BOTHER;
  asked.c_ispeed = asked.c_ospeed = static_cast<speed_t>(bits_per_second);
  termios2 got{};
  const bool taken = ::ioctl(descriptor_, TCSETS2, &asked) == 0 && ::ioctl(descriptor_, TCGETS2, &got) == 0;
  ::ioctl(descriptor_, TCSETS2, &before);
  // A clock divider may miss the rate a little: a byte survives 2 %.
  constexpr int kPart = 50;
  const int off = static_cast<int>(got.c_ospeed) - bits_per_second;
  return taken && std::abs(off) <= bits_per_second / kPart;
}

bool SerialPort::set_baud(int bits_per_second) noexcept {
  if (!configure(bits_per_second)) {
    return false;
  }
  ::ioctl(descriptor_, TCFLSH, TCIFLUSH);
  return true;
}

bool SerialPort::configure(int bits_per_second) noexcept {
  termios2 settings{};
  if (::ioctl(descriptor_, TCGETS2, &settings) != 0) {
    return configure_by_name(bits_per_second);
  }
  make_raw(settings);
  settings.c_cflag |= BOTHER;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(bits_per_second);
  return ::ioctl(descriptor_, TCSETS2, &settings) == 0 || configure_by_name(bits_per_second);
}

// For ports whose driver has the old calls only.
bool SerialPort::configure_by_name(int bits_per_second) noexcept {
  termios settings{};
  const auto* const rate =
      std::find_if(std::begin(kNamedRates), std::end(kNamedRates),
                   [&](const NamedRate& known) { return known.bits_per_second == bits_per_second; });
  if (rate == std::end(kNamedRates) || ::ioctl(descriptor_, TCGETS, &settings) != 0) {
    return false;
  }
  make_raw(settings);
  settings.c_cflag |= rate->name;
  return ::ioctl(descriptor_, TCSETS, &settings) == 0;
}

// FTDI's chips hold bytes back for 16 ms unless they are asked not to.
void SerialPort::ask_for_low_latency() noexcept {
  serial_struct settings{};
  if (::ioctl(descriptor_, TIOCGSERIAL, &settings) == 0) {
    settings.flags |= ASYNC_LOW_LATENCY;
    ::ioctl(descriptor_, TIOCSSERIAL, &settings);
  }
}

bool SerialPort::send_break() noexcept { return ::ioctl(descriptor_, TCSBRK, 0) == 0; }

std::string_view describe_open_error(int error) noexcept {
  switch (error) {
    case EACCES:
    case EPERM:
      return "may not be opened: add the daemon's user to the group of the port (dialout)";
    case EBUSY:
      return "is used by another program: close that (fuser -v names it)";
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "is not there: plug in the cable, switch the tracker on, see /dev/serial/by-id";
    case ENOTTY:
    case EISDIR:
      return "is no serial port: see em.device";
    case EIO:
      return "does not work: unplug its cable and plug it in again";
    default:
      return "cannot be opened";
  }
}

}  // namespace tubed
