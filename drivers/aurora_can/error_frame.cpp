#include "drivers/aurora_can/error_frame.hpp"

#include <linux/can.h>
#include <linux/can/error.h>

namespace tubed {

CanTrouble read_error_frame(std::uint32_t id, std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::size_t kControllerAt = 1;  // Documentation/networking/can.rst, error frames
  const unsigned controller = (id & CAN_ERR_CRTL) != 0 && bytes.size() > kControllerAt ? bytes[1] : 0U;
  CanTrouble trouble;
  trouble.bus_off = (id & CAN_ERR_BUSOFF) != 0;
  trouble.restarted = (id & CAN_ERR_RESTARTED) != 0;
  trouble.passive = (controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
  trouble.warning = (controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0;
  trouble.receive_overflow = (controller & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
  trouble.no_acknowledgement = (id & CAN_ERR_ACK) != 0;
  trouble.protocol_violation = (id & (CAN_ERR_PROT | CAN_ERR_BUSERROR)) != 0;
  return trouble;
}

std::string_view describe(const CanTrouble& trouble) noexcept {
  if (trouble.bus_off) {
    return "is bus-off: look at cable, termination, bit rates; `ip link set NAME type can restart-ms 100` "
           "restarts it";
  }
  if (trouble.protocol_violation) {
    return "sees damaged frames: look at cable and termination, and at the bit rates of both ends";
  }
  if (trouble.no_acknowledgement) {
    return "gets no acknowledgement: nobody else is on the bus";
  }
  if (trouble.receive_overflow) {
    return "loses frames in its controller: this machine is too slow for it";
  }
  if (trouble.passive || trouble.warning) {
    return "counts many errors: look at cable and termination, and at the bit rates of both ends";
  }
  return "reports errors";
}

}  // namespace tubed
