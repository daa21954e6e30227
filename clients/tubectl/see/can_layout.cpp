#include "clients/tubectl/see/can_layout.hpp"

#include <stdexcept>

#include "drivers/aurora_can/can_port.hpp"

namespace tubed {

std::string can_layout(const std::string& interface) {
  if (interface.empty()) return "fd";
  const auto error_of = [&interface](CanUse use) { return CanInterface(interface, use).open(); };
  if (error_of(CanUse::kSendFd) == 0) return "fd";
  const int error = error_of(CanUse::kSendClassic);
  if (error != 0) {
    throw std::runtime_error(
        interface + " " + std::string(describe_can_error(error)) +
        "\na virtual one, as root: modprobe vcan; ip link add vcan0 type vcan; ip link set vcan0 mtu 72 up"
        "\nwithout --can the frames go through a socket, which needs neither");
  }
  return "classic";
}

}  // namespace tubed
