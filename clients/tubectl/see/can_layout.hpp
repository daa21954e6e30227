// How a gateway may send frames over a CAN interface.
#pragma once

#include <string>

namespace tubed {

/// "fd" when this interface carries frames of CAN FD, or when none is named (then a socket carries them);
/// "classic" when it carries frames of 8 bytes only. Throws std::runtime_error with what to do when the
/// interface cannot be used.
[[nodiscard]] std::string can_layout(const std::string& interface);

}  // namespace tubed
