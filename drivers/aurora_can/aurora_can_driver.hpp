// The driver "aurora-can": an NDI Aurora behind a gateway on a CAN bus.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/aurora/can_identifiers.hpp"
#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// The keys of the table [aurora-can].
std::vector<KeyDescription> aurora_can_settings();

/// This driver as the registry has it.
DriverDescription aurora_can_driver();

/// The gateway's identifiers, by base_id and extended_ids. Throws std::invalid_argument with words when there
/// are no such.
aurora::CanBase can_base_of(const DriverSettings& settings);

/// The gateway's tracker at `device`, an interface as can0, or the path of a gateway's socket: sensor i of
/// `room` is coil i - 1 of the gateway.
std::unique_ptr<EmSource> make_aurora_can_em_source(const RoomDescription& room,
                                                    const DriverSettings& settings,
                                                    const std::string& device);

}  // namespace tubed
