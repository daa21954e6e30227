#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "drivers/aurora_can/can_port.hpp"
#include "drivers/aurora_can/last_error.hpp"
#include "drivers/aurora_can/network_interface.hpp"

namespace tubed {

namespace {

/// Data frames of one block, with identifiers of its size: all that a gateway sends.
can_filter filter_of(aurora::CanBase base) noexcept {
  constexpr canid_t kBlockMask = CAN_EFF_MASK & ~(aurora::CanBase::kBlock - 1);
  return {base.id, kBlockMask | CAN_EFF_FLAG | CAN_RTR_FLAG};
}

template <typename Value>
bool set(int descriptor, int level, int option, const Value& value) noexcept {
  return ::setsockopt(descriptor, level, option, &value, sizeof value) == 0;
}

/// Index of the interface, or -errno: not there, no CAN, down, or without CAN FD (EMSGSIZE) when that is
/// needed.
int find_can_interface(const std::string& name, bool needs_fd) noexcept {
  NetworkInterface found;
  if (const int error = find_network_interface(name, found); error != 0) {
    return -error;
  }
  constexpr int kArpHardwareCan = 280;  // ARPHRD_CAN
  if (found.hardware != kArpHardwareCan) {
    return -ENOTSOCK;
  }
  if (!found.is_up) {
    return -ENETDOWN;
  }
  return needs_fd && found.mtu_bytes < static_cast<int>(CANFD_MTU) ? -EMSGSIZE : found.index;
}

}  // namespace

int CanInterface::connect() noexcept {
  const int descriptor = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (descriptor < 0) {
    return -last_error();
  }
  const int error = configure(descriptor);
  if (error != 0) {
    ::close(descriptor);
    return -error;
  }
  return descriptor;
}

int CanInterface::configure(int descriptor) const noexcept {
  const int index = find_can_interface(name_, use_ == CanUse::kSendFd);
  if (index < 0) {
    return -index;
  }
  constexpr int kOn = 1;
  constexpr can_err_mask_t kAllErrors = CAN_ERR_MASK;
  bool good = set(descriptor, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, kOn);
  if (use_ == CanUse::kReceive || use_ == CanUse::kListen) {
    good = good &&
           (use_ == CanUse::kListen || set(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, filter_of(base_))) &&
           set(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, kAllErrors);
    // Without these times are a little later, losses are seen in the frame numbers only.
    set(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, kOn);
    set(descriptor, SOL_SOCKET, SO_RXQ_OVFL, kOn);
    if (receive_buffer_ > 0) {
      set(descriptor, SOL_SOCKET, SO_RCVBUF, receive_buffer_);
    }
  } else {
    good = good && ::setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0) == 0;
  }
  if (!good) {
    return last_error();
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  return ::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0
                                                                                              : last_error();
}

std::string_view describe_can_error(int error) noexcept {
  switch (error) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
      return "cannot be opened: no CAN in this kernel (modprobe can_raw), or the service may not use it: "
             "install /usr/share/tubed/can.conf as its first lines say";
    case EPERM:
    case EACCES:
      return "may not be opened: a container or a security policy forbids raw CAN sockets to this user";
    case ENODEV:
    case ENXIO:
      return "is not there: `ip -br link show type can` lists the interfaces; see em.device";
    case ENOTSOCK:
      return "is no CAN interface: `ip -br link show type can` lists those; see em.device";
    case ENETDOWN:
      return "is down: `ip link set NAME up type can bitrate 500000 dbitrate 2000000 fd on`, with the "
             "gateway's bit rates";
    case EMSGSIZE:
    case EINVAL:
      return "carries classic frames only: `ip link set NAME type can fd on` (virtual ones: mtu 72), or send "
             "--layout classic";
    case ENOBUFS:
      return "takes no frames: nobody acknowledges them, or its queue is too short (`ip link set NAME "
             "txqueuelen 128`)";
    default:
      return "does not work";
  }
}

}  // namespace tubed
