// Commands to the emulator while it runs, as text: what is plugged, pulled, broken and by what chance.
#pragma once

#include <string>
#include <string_view>

#include "drivers/laboratory/aurora_emulator/device.hpp"

namespace tubed::aurora::emulator {

/// Carries out one command given at `now` (the README of this folder lists them). Returns nothing, or what is
/// wrong with a command, which then has changed nothing.
[[nodiscard]] std::string apply_control(std::string_view command, Device& device, MonotonicTime now);

}  // namespace tubed::aurora::emulator
