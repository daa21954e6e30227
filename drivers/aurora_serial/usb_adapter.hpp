// The USB adapter behind a serial port, as /sys describes it.
#pragma once

#include <sys/types.h>

#include <optional>

#include "drivers/aurora/words.hpp"
#include "drivers/aurora_serial/system_files.hpp"

namespace tubed {

/// What stays the same when an adapter is pulled out and plugged in again.
struct UsbIdentity {
  unsigned vendor = 0;
  unsigned product = 0;
  unsigned interface = 0;  ///< of an adapter with several ports
  BoundedText<64> serial_number;

  friend bool operator==(const UsbIdentity&, const UsbIdentity&) = default;
};

/// The adapter of the character device `device` (st_rdev); nothing when it is no USB adapter. Like all here:
/// any thread, never allocates.
std::optional<UsbIdentity> usb_identity(const SystemPlaces& places, dev_t device) noexcept;

/// Milliseconds for which FTDI's chip holds back what does not fill a packet; nothing for other adapters.
std::optional<int> latency_timer_ms(const SystemPlaces& places, dev_t device) noexcept;

/// Name of the device in /dev, as "ttyUSB1"; empty when the kernel does not say.
BoundedText<32> device_name(const SystemPlaces& places, dev_t device) noexcept;

/// The name under which the adapter `identity` is there; empty when it is not, or when several are alike.
BoundedText<32> find_adapter(const SystemPlaces& places, const UsbIdentity& identity) noexcept;

/// The link in /dev/serial/by-id that leads to the device `name`: it stays when the name changes. Empty when
/// there is none.
BoundedText<160> path_by_id(const SystemPlaces& places, std::string_view name) noexcept;

/// "0403:da74, serial number ABC".
BoundedText<96> describe(const UsbIdentity& identity) noexcept;

}  // namespace tubed
