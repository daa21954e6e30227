#include "drivers/aurora_serial/port_surroundings.hpp"

#include <sys/stat.h>

#include <cerrno>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

using std::chrono::seconds;

constexpr seconds kBetweenLooks{1};
constexpr int kBestLatencyTimer_ms = 1;
constexpr int kUsualLatencyTimer_ms = 16;

aurora::Problem& operator<<(aurora::Problem& words, const PortHolder& holder) {
  if (holder.program.empty()) {
    return words << "process " << holder.process;
  }
  return words << holder.program.text() << " (process " << holder.process << ")";
}

bool is_absence(int error) { return error == ENOENT || error == ENODEV || error == ENXIO; }

}  // namespace

void PortSurroundings::opened(dev_t device) noexcept {
  device_ = device;
  adapter_ = usb_identity(places_, device);
  others_.begin();
  look_around(kMaxLook);
}

void PortSurroundings::look_around(std::chrono::nanoseconds longest) noexcept {
  latency_timer_ms_ = latency_timer_ms(places_, device_);
  others_.look(device_, monotonic_now() + longest);
}

aurora::Problem PortSurroundings::note() const noexcept {
  aurora::Problem words;
  if (const PortHolder& other = others_.found(); other.process != 0) {
    words << other;
    words << " has " << path_ << " open as well, and each takes bytes from the other: close that program";
  }
  if (latency_timer_ms_.value_or(0) > kBestLatencyTimer_ms) {
    const auto late = describe_latency_timer(*latency_timer_ms_, name().text());
    words << (words.empty() ? "" : "; ") << late.text();
  }
  return words;
}

aurora::Problem PortSurroundings::explain(int error, int lock_owner,
                                          std::chrono::nanoseconds longest) noexcept {
  if (error == EBUSY) {
    return explain_use(lock_owner, longest);
  }
  others_.begin();
  return is_absence(error) ? explain_absence(error)
                           : aurora::Problem(path_) << " " << describe_open_error(error);
}

aurora::Problem PortSurroundings::explain_use(int lock_owner, std::chrono::nanoseconds longest) noexcept {
  PortHolder holder = lock_owner > 0 ? program_of(places_, lock_owner) : others_.found();
  const MonotonicTime now = monotonic_now();
  struct stat port {};
  if (lock_owner <= 0 && now >= next_look_ && ::stat(path_.c_str(), &port) == 0) {
    next_look_ = now + kBetweenLooks;
    others_.look(port.st_rdev, now + longest);
    holder = others_.found();
  }
  aurora::Problem words(path_);
  if (holder.process == 0) {
    return words << " " << describe_open_error(EBUSY);
  }
  words << " is used by ";
  words << holder;
  return words << ": close that program";
}

// A path below /dev/serial/by-id leads to the adapter whatever its name is.
aurora::Problem PortSurroundings::explain_absence(int error) const noexcept {
  aurora::Problem words(path_);
  const std::string_view name = last_component(path_);
  const BoundedText<32> found =
      adapter_ && name.starts_with("tty") ? find_adapter(places_, *adapter_) : BoundedText<32>();
  if (found.empty() || found.text() == name) {
    return words << " " << describe_open_error(error);
  }
  const auto lasting = path_by_id(places_, found.text());
  return words << " is not there: its adapter is back as /dev/" << found.text() << "; set em.device to "
               << (lasting.empty() ? "its link in /dev/serial/by-id" : lasting.text())
               << ", which always leads to it";
}

std::string_view describe_open_error(int error) noexcept {
  switch (error) {
    case EACCES:
    case EPERM:
      return "may not be opened: add the daemon's user to the group of the port (dialout, tubed for NDI's "
             "own)";
    case EBUSY:
      return "is used by another program: close that (fuser -v with this path, as root, names it)";
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

aurora::Problem describe_latency_timer(int milliseconds, std::string_view device_name) noexcept {
  aurora::Problem words;
  if (milliseconds <= kBestLatencyTimer_ms) {
    return words;
  }
  words << "the USB adapter holds replies back for " << milliseconds << " ms";
  if (milliseconds == kUsualLatencyTimer_ms) {
    words << " (28 instead of 40 measurements a second with 5 coils at 115200 baud)";
  }
  return words << ": install 60-tubed.rules, or as root echo 1 > /sys/bus/usb-serial/devices/" << device_name
               << "/latency_timer";
}

}  // namespace tubed
