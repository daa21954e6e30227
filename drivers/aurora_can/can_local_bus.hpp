// A bus of one listener on one machine, where there is no CAN: the same frames through a socket in the file
// system.
#pragma once

#include <memory>
#include <string>

#include "drivers/aurora_can/can_port.hpp"

namespace tubed {

/// The receiver: connects to the socket that a gateway has made at `path`. What arrives is `can_frame` and
/// `canfd_frame`, as from an interface, and stamped by the kernel; there is no controller, hence no error
/// frame, and no frame is lost but when the gateway finds the queue full.
class LocalBusReceiver final : public CanPort {
 public:
  explicit LocalBusReceiver(std::string path) : path_(std::move(path)) {}

  [[nodiscard]] std::string_view name() const noexcept override { return path_; }
  [[nodiscard]] std::string_view describe(int error) const noexcept override;

 protected:
  int connect() noexcept override;

 private:
  std::string path_;
};

/// The gateway: makes the socket, for its user and group alone, and takes it away with itself. One receiver
/// at a time; open() gives ENOTCONN while there is none, and the next one is taken when that one has gone.
class LocalBusSender final : public CanPort {
 public:
  explicit LocalBusSender(std::string path) : path_(std::move(path)) {}
  ~LocalBusSender() override;

  [[nodiscard]] std::string_view name() const noexcept override { return path_; }
  [[nodiscard]] std::string_view describe(int error) const noexcept override;

 protected:
  int connect() noexcept override;

 private:
  [[nodiscard]] int listen() noexcept;

  std::string path_;
  int listener_ = -1;
};

/// `device` is the name of an interface, or the path of a socket when there is a slash in it.
/// `base`: of the gateway to receive from; a socket carries whatever its gateway sends.
[[nodiscard]] std::unique_ptr<CanPort> make_can_port(const std::string& device, CanUse use,
                                                     int receive_buffer = 0, aurora::CanBase base = {});

}  // namespace tubed
