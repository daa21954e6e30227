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
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "drivers/interface/descriptor_wait.hpp"

namespace tubed {

namespace {

constexpr int kFirstRate = 9600;
constexpr std::chrono::milliseconds kWriteTimeout{200};
constexpr std::chrono::milliseconds kDiscardTimeout{100};
constexpr std::chrono::milliseconds kBetweenDiscards{5};
constexpr std::chrono::milliseconds kBreak{280};  // tcsendbreak makes 250 to 500 ms
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
  lock_owner_ = 0;
  descriptor_ = ::open(path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) {
    return errno;
  }
  if (const int error = take_for_us(); error != 0) {
    ::close(std::exchange(descriptor_, -1));  // and nothing else: it may be somebody's
    return error;
  }
  if (!configure(kFirstRate)) {
    const int error = errno == 0 ? EIO : errno;
    close();
    return error;
  }
  ask_for_low_latency();
  shorten_closing();
  ::ioctl(descriptor_, TIOCMBIS, &kModemLines);  // some adapters are powered by them; others have none
  ::ioctl(descriptor_, TCFLSH, TCIOFLUSH);
  struct stat port {};
  ::fstat(descriptor_, &port);
  surroundings_.opened(port.st_rdev);
  return 0;
}

// Each program has its own way to keep others out: NDI's libraries lock records (fcntl), others whole files
// (flock). TIOCEXCL keeps out programs that open the port later, but not those of root.
int SerialPort::take_for_us() noexcept {
  termios settings{};
  if (::ioctl(descriptor_, TCGETS, &settings) != 0) {
    return ENOTTY;
  }
  if (!lock_records() || (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)) {
    return EBUSY;
  }
  ::ioctl(descriptor_, TIOCEXCL);
  return 0;
}

// Of the open file description: another port of this process that is closed does not release it.
bool SerialPort::lock_records() noexcept {
  struct flock whole_file {};
  whole_file.l_type = F_WRLCK;
  whole_file.l_whence = SEEK_SET;
  if (::fcntl(descriptor_, F_OFD_SETLK, &whole_file) == 0 || (errno != EAGAIN && errno != EACCES)) {
    return true;
  }
  whole_file.l_pid = 0;
  if (::fcntl(descriptor_, F_OFD_GETLK, &whole_file) == 0 && whole_file.l_type != F_UNLCK) {
    lock_owner_ = std::max(static_cast<int>(whole_file.l_pid), 0);  // -1: of an open file description
  }
  return false;
}

void SerialPort::close() noexcept {
  if (is_open()) {
    ::ioctl(descriptor_, TCFLSH, TCOFLUSH);
    ::ioctl(descriptor_, TIOCNXCL);
    ::close(std::exchange(descriptor_, -1));
  }
}

void SerialPort::look_around(std::chrono::nanoseconds longest) noexcept {
  if (is_open()) {
    surroundings_.look_around(longest);
  }
}

MonotonicTime SerialPort::now() noexcept { return monotonic_now(); }

bool SerialPort::write(aurora::Bytes bytes) noexcept {
  const MonotonicTime deadline = now() + kWriteTimeout;
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

void SerialPort::wait(MonotonicTime deadline) noexcept { wait_for(descriptor_, POLLIN, deadline); }

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

// close() lets the line have its last bytes for 30 s; a line that is stuck would keep the thread for as long.
// Only root may shorten that: apart from low latency, which anybody may ask for.
void SerialPort::shorten_closing() noexcept {
  constexpr unsigned short kHundredths = 20;
  serial_struct settings{};
  if (::ioctl(descriptor_, TIOCGSERIAL, &settings) == 0 && settings.closing_wait != ASYNC_CLOSING_WAIT_NONE &&
      (settings.closing_wait == ASYNC_CLOSING_WAIT_INF || settings.closing_wait > kHundredths)) {
    settings.closing_wait = kHundredths;
    ::ioctl(descriptor_, TIOCSSERIAL, &settings);
  }
}

// False: the line still has bytes that it does not take; USB adapters keep what they were given.
bool SerialPort::discard_output() noexcept {
  const MonotonicTime end = now() + kDiscardTimeout;
  ::ioctl(descriptor_, TCFLSH, TCOFLUSH);
  for (;;) {
    int waiting = 0;
    if (::ioctl(descriptor_, TIOCOUTQ, &waiting) != 0 || waiting == 0) {
      return true;
    }
    if (!sleep_until(now() + kBetweenDiscards, end)) {
      return false;
    }
  }
}

// TCSBRK, and TIOCSBRK as well, wait for everything to be sent first, without end when the line is stuck.
bool SerialPort::send_break() noexcept {
  if (!discard_output() || ::ioctl(descriptor_, TIOCSBRK, 0) != 0) {
    return false;
  }
  sleep_until(now() + kBreak, MonotonicTime::max());
  return ::ioctl(descriptor_, TIOCCBRK, 0) == 0;
}

}  // namespace tubed
