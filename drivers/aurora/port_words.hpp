// What is wrong with the plugs of a tracker, in words: the cause first, then what it costs. Any thread; no
// state, no allocation.
#pragma once

#include <bitset>
#include <span>

#include "drivers/aurora/coil_map.hpp"
#include "drivers/aurora/port_setup.hpp"
#include "drivers/aurora/status.hpp"
#include "drivers/aurora/words.hpp"

namespace tubed::aurora {

/// By place in the list of found coils.
using FoundSet = std::bitset<kMaxHandles>;

/// Which coils of `map` are not tracked and why; empty when all are. `pulled` are those of `found` whose tool
/// was unplugged since. "port 2: ERROR13, cannot initialise the port handle: ...; sensors 3, 4 left out; port
/// 4: no tool; sensor 6 left out".
[[nodiscard]] Problem describe_missing(const CoilMap& map, std::span<const FoundCoil> found,
                                       const FoundSet& pulled) noexcept;

/// What is plugged in and not in `map`, as a sentence: "not in the configuration, not tracked: port 4
/// channel 0, port 4 channel 1". Empty when everything is.
[[nodiscard]] Problem describe_unused(const CoilMap& map, std::span<const FoundCoil> found) noexcept;

/// What the tracker complains of; empty when it does not. "the field generator or other hardware was
/// unplugged or changed: check its cable".
[[nodiscard]] Problem describe_system_status(SystemStatus status) noexcept;

}  // namespace tubed::aurora
