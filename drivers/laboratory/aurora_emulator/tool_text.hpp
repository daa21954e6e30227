// What PHINF and PHSR say, as text.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/laboratory/aurora_emulator/port_handles.hpp"

namespace tubed::aurora::emulator {

/// `value` as that many upper-case hexadecimal digits.
[[nodiscard]] std::string hex(std::uint32_t value, int digits);

/// Payload of PHSR.
[[nodiscard]] std::string handle_list_text(const std::vector<PortHandle>& handles);

/// Payload of PHINF for `fields` (any of 0001, 0002, 0004, 0008, 0010, 0020, in this order in the reply).
[[nodiscard]] std::string tool_text(const PortHandle& handle, const Plug& plug, std::uint32_t fields);

}  // namespace tubed::aurora::emulator
