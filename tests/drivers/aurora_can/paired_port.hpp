// A CanPort at a socket pair, and the other end of the bus.
#pragma once

#include <linux/can.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <span>

#include "drivers/aurora_can/can_port.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

/// The bus: frames given to it arrive at the port that is open.
struct Bus {
  Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;
  ~Bus() { unplug(); }

  void send_raw(const void* bytes, std::size_t size) const {
    if (far_end >= 0) {
      static_cast<void>(::send(far_end, bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL));
    }
  }
  void send(const aurora::CanFrame& frame) const {
    canfd_frame raw{};
    raw.can_id = frame.id;
    raw.len = frame.size;
    std::copy_n(frame.bytes.begin(), frame.size, raw.data);
    send_raw(&raw, frame.size > CAN_MAX_DLEN ? CANFD_MTU : CAN_MTU);
  }
  void send(std::span<const aurora::CanFrame> frames) const {
    for (const aurora::CanFrame& frame : frames) {
      send(frame);
    }
  }
  void send_error(std::uint32_t classes, std::uint8_t controller = 0) const {
    can_frame raw{};
    raw.can_id = CAN_ERR_FLAG | classes;
    raw.can_dlc = CAN_ERR_DLC;
    raw.data[1] = controller;
    send_raw(&raw, CAN_MTU);
  }
  void unplug() {
    if (far_end >= 0) {
      ::close(far_end);
      far_end = -1;
    }
  }

  int far_end = -1;
  int refuses_with = 0;  ///< errno of the next openings; 0: they succeed
  int openings = 0;
};

class PairedPort final : public CanPort {
 public:
  explicit PairedPort(Bus& bus) : bus_(bus) {}
  [[nodiscard]] std::string_view name() const noexcept override { return "can0"; }

 protected:
  int connect() noexcept override {
    ++bus_.openings;
    if (bus_.refuses_with != 0) {
      return -bus_.refuses_with;
    }
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      return -errno;
    }
    bus_.unplug();
    bus_.far_end = ends[1];
    return ends[0];
  }

 private:
  Bus& bus_;
};

/// For reads that have nothing to wait for: everything is in the socket already.
inline MonotonicTime at_once() { return monotonic_now(); }

}  // namespace tubed
