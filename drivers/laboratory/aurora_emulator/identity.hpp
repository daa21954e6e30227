// What the tracker says about itself: VER, SFLIST, GET, GETINFO. All of it says that it is emulated.
#pragma once

#include <string>
#include <string_view>

#include "drivers/laboratory/aurora_emulator/device_settings.hpp"
#include "drivers/laboratory/aurora_emulator/port_handles.hpp"

namespace tubed::aurora::emulator {

/// A payload, or the error in its place.
struct Said {
  std::string payload;
  Error error = Error::kNone;
};

/// Serial number of the emulated control unit.
inline constexpr std::string_view kControlUnitSerial = "A5E00042";

/// VER: the firmware (0 and 4), what is combined (5), the field generator (7), control and sensor units (8).
[[nodiscard]] Said version_text(std::string_view parameters, const DeviceSettings& settings);
/// SFLIST: features (00), volumes (03), and what 10 and 12 were recorded with.
[[nodiscard]] Said feature_text(std::string_view parameters);
/// GET: a user parameter's value.
[[nodiscard]] Said user_parameter(std::string_view name, const Firmware& firmware);
/// GETINFO: a user parameter's value in the same form, where the firmware knows the command.
[[nodiscard]] Said user_parameter_info(std::string_view name, const Firmware& firmware);

}  // namespace tubed::aurora::emulator
