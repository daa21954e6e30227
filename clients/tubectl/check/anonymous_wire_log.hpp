// Wire logs without serial numbers. Pure.
#pragma once

#include "drivers/aurora/wire_log.hpp"

namespace tubed {

/// `log` with zeros for the serial numbers of tools and of the tracker's parts, wherever the tracker said
/// them (PHINF, VER), and with check sums that are right again. What came damaged in answer to such a
/// question is all zeros. Header lines stay as they are.
[[nodiscard]] aurora::WireLog without_serial_numbers(aurora::WireLog log);

}  // namespace tubed
