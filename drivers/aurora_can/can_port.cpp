#include "drivers/aurora_can/can_port.hpp"

#include <linux/can.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/interface/descriptor_wait.hpp"

namespace tubed {

namespace {

static_assert(aurora::kCanExtended == CAN_EFF_FLAG, "identifiers are handed to the kernel as they are");

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
/// A full queue is looked at again after so long: less than a frame at 500 kbit/s takes.
constexpr std::chrono::microseconds kQueuePause{200};
/// A stamp further back than this is not believed: CLOCK_REALTIME was set meanwhile.
constexpr std::chrono::seconds kOldestStamp{1};

std::chrono::nanoseconds duration_of(const timespec& time) noexcept {
  return std::chrono::nanoseconds(time.tv_sec * kNsPerSecond + time.tv_nsec);
}

/// The kernel stamps by CLOCK_REALTIME: how old the stamp is now says when that was by ours.
MonotonicTime monotonic_of(const timespec& stamp) noexcept {
  timespec wall{};
  ::clock_gettime(CLOCK_REALTIME, &wall);
  const MonotonicTime now = monotonic_now();
  const std::chrono::nanoseconds age = duration_of(wall) - duration_of(stamp);
  return age >= std::chrono::nanoseconds(0) && age < kOldestStamp ? now - age : now;
}

/// What came beside the frame.
struct Beside {
  MonotonicTime received{};
  std::uint32_t overflow = 0;
};

Beside read_control(msghdr& message, std::uint32_t overflow_before) noexcept {
  Beside beside{{}, overflow_before};
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET) {
      continue;
    }
    if (header->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(header), sizeof stamp);
      beside.received = monotonic_of(stamp);
    } else if (header->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&beside.overflow, CMSG_DATA(header), sizeof beside.overflow);
    }
  }
  if (beside.received == MonotonicTime{}) {
    beside.received = monotonic_now();
  }
  return beside;
}

void take_frame(const canfd_frame& raw, std::size_t size, CanArrival& arrival) noexcept {
  const std::size_t room = size == CAN_MTU ? CAN_MAX_DLEN : CANFD_MAX_DLEN;
  if ((size != CAN_MTU && size != CANFD_MTU) || raw.len > room) {
    arrival.kind = CanArrival::Kind::kUnreadable;
    return;
  }
  if ((raw.can_id & CAN_ERR_FLAG) != 0) {
    arrival.kind = CanArrival::Kind::kErrorFrame;
    arrival.trouble = read_error_frame(raw.can_id, {raw.data, raw.len});
    return;
  }
  if ((raw.can_id & CAN_RTR_FLAG) != 0) {
    arrival.kind = CanArrival::Kind::kUnreadable;
    return;
  }
  arrival.kind = CanArrival::Kind::kFrame;
  const bool is_extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  arrival.frame.id = raw.can_id & (is_extended ? CAN_EFF_FLAG | CAN_EFF_MASK : CAN_SFF_MASK);
  arrival.frame.size = raw.len;
  std::copy_n(raw.data, raw.len, arrival.frame.bytes.begin());
}

}  // namespace

std::string_view CanPort::describe(int error) const noexcept { return describe_can_error(error); }

int CanPort::open() noexcept {
  if (is_open()) {
    return 0;
  }
  const int descriptor = connect();
  if (descriptor < 0) {
    return -descriptor;
  }
  descriptor_ = descriptor;
  overflow_seen_ = 0;
  return 0;
}

void CanPort::close() noexcept {
  if (is_open()) {
    ::close(std::exchange(descriptor_, -1));
  }
}

void CanPort::wait(MonotonicTime deadline) noexcept { wait_for(descriptor_, POLLIN, deadline); }

CanArrival CanPort::read(MonotonicTime deadline) noexcept {
  CanArrival arrival;
  canfd_frame raw{};
  iovec room{&raw, sizeof raw};
  alignas(cmsghdr) std::array<char, 256> control;
  for (;;) {
    msghdr message{};
    message.msg_iov = &room;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(descriptor_, &message, MSG_DONTWAIT);
    if (size > 0) {
      const Beside beside = read_control(message, overflow_seen_);
      overflowed_ += beside.overflow - std::exchange(overflow_seen_, beside.overflow);
      arrival.received = beside.received;
      const bool cut = (message.msg_flags & MSG_TRUNC) != 0;
      take_frame(raw, cut ? 0 : static_cast<std::size_t>(size), arrival);
      return arrival;
    }
    if (size == 0 || (errno != EAGAIN && errno != EINTR)) {
      arrival.kind = CanArrival::Kind::kGone;
      arrival.error = size == 0 ? ENODEV : errno;
      return arrival;
    }
    if (errno == EAGAIN && !wait_for(descriptor_, POLLIN, deadline)) {
      return arrival;
    }
  }
}

int CanPort::write(const aurora::CanFrame& frame, MonotonicTime deadline) noexcept {
  const bool fast = frame.size > CAN_MAX_DLEN;
  canfd_frame raw{};
  raw.can_id = frame.id;
  raw.len = static_cast<std::uint8_t>(frame.payload().size());
  raw.flags = fast ? CANFD_BRS : 0;
  std::copy_n(frame.bytes.begin(), raw.len, raw.data);
  const std::size_t size = fast ? CANFD_MTU : CAN_MTU;
  for (;;) {
    const ssize_t written = ::send(descriptor_, &raw, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written == static_cast<ssize_t>(size)) {
      return 0;
    }
    const int error = written < 0 ? errno : EIO;
    if (error == EINTR) {
      continue;
    }
    if (error != ENOBUFS && error != EAGAIN) {
      return error;
    }
    // A socket says when it has room, the queue of an interface does not.
    const MonotonicTime now = monotonic_now();
    if (now >= deadline) {
      return ENOBUFS;
    }
    if (error == EAGAIN) {
      wait_for(descriptor_, POLLOUT, deadline);
    } else {
      sleep_until(now + kQueuePause, deadline);
    }
  }
}

}  // namespace tubed
