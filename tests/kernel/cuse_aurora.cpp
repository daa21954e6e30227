// An emulated Aurora behind a serial port that knows a break: cuse_aurora NAME RATE LOG makes /dev/NAME, at
// which the tracker speaks at RATE bits per second, and writes into LOG what the port is told.
//
// A pseudo-terminal drops breaks. A character device in user space (CUSE) is told of them by the same ioctl
// that a serial port's driver gets. Needs /dev/cuse and its root.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <poll.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#define FUSE_USE_VERSION 31
#include <cuse_lowlevel.h>
#include <fuse_opt.h>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/laboratory/aurora_emulator/device.hpp"

namespace tubed {
namespace {

namespace emulator = aurora::emulator;
using std::chrono::milliseconds;

/// What the terminal layer of Linux makes of TCSBRK with 0, and what a unit of TCSBRKP is.
constexpr milliseconds kBreak{250};
constexpr milliseconds kBreakUnit{100};
/// A little more than the tracker needs for RESET, and for a reply.
constexpr milliseconds kReset{1400};
constexpr milliseconds kReply{150};

/// A straight catheter along x, 200 mm below the field generator, that goes 5 mm to and fro.
emulator::MeasuredCoils sliding(std::uint64_t /*measurement*/, MonotonicTime time) {
  const double slid_mm = 5 * std::sin(seconds_between(MonotonicTime{}, time));
  emulator::MeasuredCoils coils;
  std::size_t coil = 0;
  for (const double offset_from_tip_mm : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    coils[coil].status = CoilStatus::kOk;
    coils[coil].p_em_mm = {slid_mm - offset_from_tip_mm, 0, -200};
    coils[coil].tangent_em = {1, 0, 0};
    ++coil;
  }
  return coils;
}

/// Port and tracker. One thread: requests of the kernel and step() take turns.
class CuseSerialPort {
 public:
  CuseSerialPort(int tracker_rate, const char* log)
      : device_({}, sliding, monotonic_now()), log_(std::fopen(log, "w")) {
    if (log_ == nullptr) {
      std::perror(log);
      std::exit(1);
    }
    set_tracker_rate(tracker_rate);
  }

  /// When step() has something to do next.
  [[nodiscard]] MonotonicTime next_event() const { return std::min(device_.next_event(), break_ends_); }

  void step() {
    const MonotonicTime now = monotonic_now();
    if (now >= break_ends_) {
      break_ends_ = MonotonicTime::max();
      end_break(now);
      fuse_reply_ioctl(break_request_, 0, nullptr, 0);
    }
    std::vector<std::uint8_t> arrived;
    device_.transmit(now, rate_, arrived);
    waiting_.insert(waiting_.end(), arrived.begin(), arrived.end());
    const int tracker_rate = bits_per_second(device_.link().rate);
    if (tracker_rate != std::exchange(logged_tracker_rate_, tracker_rate)) {
      log("tracker", tracker_rate);
    }
    serve_readers();
  }

  void open(fuse_req_t request, fuse_file_info* file) {
    log("open", 0);
    file->direct_io = 1;
    file->nonseekable = 1;
    fuse_reply_open(request, file);
  }

  void release(fuse_req_t request) {
    log("close", 0);
    fuse_reply_err(request, 0);
  }

  void read(fuse_req_t request, std::size_t size, const fuse_file_info* file) {
    if (waiting_.empty() && (file->flags & O_NONBLOCK) != 0) {
      fuse_reply_err(request, EAGAIN);
      return;
    }
    readers_.push_back({request, size});
    serve_readers();
  }

  void write(fuse_req_t request, const char* bytes, std::size_t size) {
    device_.receive({reinterpret_cast<const std::uint8_t*>(bytes), size}, rate_, monotonic_now());
    fuse_reply_write(request, size);
  }

  void poll(fuse_req_t request, fuse_pollhandle* handle) {
    if (handle != nullptr) {
      if (poll_ != nullptr) {
        fuse_pollhandle_destroy(poll_);
      }
      poll_ = handle;
    }
    fuse_reply_poll(request, POLLOUT | (waiting_.empty() ? 0U : static_cast<unsigned>(POLLIN)));
  }

  void ioctl(fuse_req_t request, unsigned command, void* argument, const void* in, std::size_t in_size,
             std::size_t out_room) {
    switch (command) {
      case TCGETS:
        give<termios>(request, argument, out_room);
        return;
      case TCGETS2:
        give<termios2>(request, argument, out_room);
        return;
      case TCSETS2:
        take(request, argument, in, in_size);
        return;
      case TCSBRK:
        begin_break(request, "TCSBRK", argument == nullptr ? kBreak : milliseconds(0));
        return;
      case TCSBRKP:
        begin_break(request, "TCSBRKP", reinterpret_cast<std::intptr_t>(argument) * kBreakUnit);
        return;
      case TIOCSBRK:
        break_began_ = monotonic_now();
        break_name_ = "TIOCSBRK";
        break;
      case TIOCCBRK:
        end_break(monotonic_now());
        break;
      case TCFLSH:
        waiting_.clear();
        break;
      case TIOCEXCL:
      case TIOCNXCL:
      case TIOCMBIS:
        break;
      default:
        fuse_reply_err(request, ENOTTY);
        return;
    }
    fuse_reply_ioctl(request, 0, nullptr, 0);
  }

 private:
  struct Reader {
    fuse_req_t request;
    std::size_t size;
  };

  // Before the port is there: as if the last client had left the tracker at that rate.
  void set_tracker_rate(int rate) {
    aurora::LinkParameters link;
    link.rate = aurora::baud_rate(rate).value();
    pass(kReset);
    device_.receive(aurora::init_command().bytes(), rate_, monotonic_now());
    pass(kReply);
    device_.receive(aurora::comm_command(link).bytes(), rate_, monotonic_now());
    pass(kReply);
    if (device_.link().rate != link.rate) {
      std::fprintf(stderr, "the tracker does not speak at %d baud\n", rate);
      std::exit(1);
    }
  }

  void pass(milliseconds time) {
    std::vector<std::uint8_t> unheard;
    sleep_until(monotonic_now() + time, MonotonicTime::max());
    device_.transmit(monotonic_now(), rate_, unheard);
    device_.transmit(monotonic_now(), rate_, unheard);  // COMM takes effect behind its reply
  }

  void log(const char* what, long number) {
    std::fprintf(log_, "%lld %s %ld\n", static_cast<long long>(to_ns(monotonic_now())), what, number);
    std::fflush(log_);
  }

  /// What a request reads or writes is told to the kernel first: it comes again with room for it.
  template <typename Settings>
  void give(fuse_req_t request, void* argument, std::size_t room) {
    if (room < sizeof(Settings)) {
      const iovec where{argument, sizeof(Settings)};
      fuse_reply_ioctl_retry(request, nullptr, 0, &where, 1);
      return;
    }
    Settings settings{};
    settings.c_cflag = CS8 | CREAD | BOTHER;
    if constexpr (requires { settings.c_ospeed; }) {
      settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(rate_);
    }
    fuse_reply_ioctl(request, 0, &settings, sizeof settings);
  }

  void take(fuse_req_t request, void* argument, const void* in, std::size_t in_size) {
    if (in_size < sizeof(termios2)) {
      const iovec where{argument, sizeof(termios2)};
      fuse_reply_ioctl_retry(request, &where, 1, nullptr, 0);
      return;
    }
    const int asked = static_cast<int>(static_cast<const termios2*>(in)->c_ospeed);
    if (asked != std::exchange(rate_, asked)) {
      log("host", rate_);
    }
    fuse_reply_ioctl(request, 0, nullptr, 0);
  }

  void begin_break(fuse_req_t request, const char* name, milliseconds duration) {
    if (duration == milliseconds(0)) {  // of TCSBRK that means: wait until everything is sent
      fuse_reply_ioctl(request, 0, nullptr, 0);
      return;
    }
    break_name_ = name;
    break_request_ = request;
    break_began_ = monotonic_now();
    break_ends_ = break_began_ + duration;
  }

  void end_break(MonotonicTime now) {
    log(break_name_, (now - break_began_) / milliseconds(1));
    device_.receive_break(now);
    waiting_.clear();
  }

  void serve_readers() {
    while (!readers_.empty() && !waiting_.empty()) {
      const std::size_t size = std::min(readers_.front().size, waiting_.size());
      const std::vector<char> bytes(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(size));
      waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(size));
      fuse_reply_buf(readers_.front().request, bytes.data(), size);
      readers_.pop_front();
    }
    if (poll_ != nullptr && !waiting_.empty()) {
      fuse_lowlevel_notify_poll(poll_);
      fuse_pollhandle_destroy(std::exchange(poll_, nullptr));
    }
  }

  emulator::Device device_;
  std::FILE* log_;
  int rate_ = 9600;  ///< of the host
  int logged_tracker_rate_ = 0;
  std::deque<std::uint8_t> waiting_;
  std::deque<Reader> readers_;
  fuse_pollhandle* poll_ = nullptr;
  fuse_req_t break_request_ = nullptr;
  const char* break_name_ = "";
  MonotonicTime break_began_{};
  MonotonicTime break_ends_ = MonotonicTime::max();
};

CuseSerialPort& port_of(fuse_req_t request) {
  return *static_cast<CuseSerialPort*>(fuse_req_userdata(request));
}

cuse_lowlevel_ops operations() {
  cuse_lowlevel_ops made{};
  made.open = [](fuse_req_t request, fuse_file_info* file) { port_of(request).open(request, file); };
  made.release = [](fuse_req_t request, fuse_file_info*) { port_of(request).release(request); };
  made.read = [](fuse_req_t request, std::size_t size, off_t, fuse_file_info* file) {
    port_of(request).read(request, size, file);
  };
  made.write = [](fuse_req_t request, const char* bytes, std::size_t size, off_t, fuse_file_info*) {
    port_of(request).write(request, bytes, size);
  };
  made.poll = [](fuse_req_t request, fuse_file_info*, fuse_pollhandle* handle) {
    port_of(request).poll(request, handle);
  };
  made.ioctl = [](fuse_req_t request, int command, void* argument, fuse_file_info*, unsigned, const void* in,
                  std::size_t in_size, std::size_t out_room) {
    port_of(request).ioctl(request, static_cast<unsigned>(command), argument, in, in_size, out_room);
  };
  return made;
}

int serve(const std::string& name, CuseSerialPort& port, char* program) {
  const std::string device_name = "DEVNAME=" + name;
  const char* about[] = {device_name.c_str()};
  cuse_info info{};
  info.dev_info_argc = 1;
  info.dev_info_argv = about;
  info.flags = CUSE_UNRESTRICTED_IOCTL;
  std::string in_foreground = "-f";
  std::string one_thread = "-s";
  char* arguments[] = {program, in_foreground.data(), one_thread.data()};
  const cuse_lowlevel_ops called = operations();
  int many_threads = 0;
  fuse_session* const session = cuse_lowlevel_setup(3, arguments, &info, &called, &many_threads, &port);
  if (session == nullptr) {
    std::fprintf(stderr, "no device /dev/%s: is the module cuse loaded?\n", name.c_str());
    return 1;
  }
  fuse_buf buffer{};
  pollfd kernel{fuse_session_fd(session), POLLIN, 0};
  while (fuse_session_exited(session) == 0) {
    const auto left = std::clamp<std::chrono::nanoseconds>(port.next_event() - monotonic_now(),
                                                           milliseconds(0), milliseconds(50));
    const timespec timeout{0, static_cast<long>(left.count())};
    if (::ppoll(&kernel, 1, &timeout, nullptr) > 0 && fuse_session_receive_buf(session, &buffer) > 0) {
      fuse_session_process_buf(session, &buffer);
    }
    port.step();
  }
  std::free(buffer.mem);
  cuse_lowlevel_teardown(session);
  return 0;
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  if (argc != 4 || !tubed::aurora::baud_rate(std::atoi(argv[2]))) {
    std::fprintf(stderr, "usage: cuse_aurora NAME RATE LOG\n");
    return 2;
  }
  tubed::CuseSerialPort port(std::atoi(argv[2]), argv[3]);
  return tubed::serve(argv[1], port, argv[0]);
}
