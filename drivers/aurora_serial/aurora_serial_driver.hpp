// The driver "aurora-serial": an NDI Aurora at a serial port.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// The keys of the table [aurora-serial].
std::vector<KeyDescription> aurora_serial_settings();

/// This driver as the registry has it.
DriverDescription aurora_serial_driver();

/// The tracker at the port `device`, whose coils are those of `room` by port and channel. Throws
/// std::runtime_error when a tool definition file cannot be read.
std::unique_ptr<EmSource> make_aurora_serial_em_source(const RoomDescription& room,
                                                       const DriverSettings& settings,
                                                       const std::string& device);

}  // namespace tubed
