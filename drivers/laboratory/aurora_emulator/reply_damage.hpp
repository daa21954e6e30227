// A reply on its way through a bad line: whole bytes in, what arrives out.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "drivers/aurora/bytes.hpp"
#include "drivers/laboratory/aurora_emulator/faults.hpp"

namespace tubed::aurora::emulator {

/// Bytes without a pause between them.
struct Piece {
  std::chrono::nanoseconds pause{};  ///< before them
  std::vector<std::uint8_t> bytes;
};

/// What `fault` makes of `reply` (a whole reply, check sums and all); `last_tracking` is the tracking reply
/// before it, empty when there is none. Faults that do not touch the bytes of a reply leave it as it is.
[[nodiscard]] std::vector<Piece> damage_reply(Fault fault, std::vector<std::uint8_t> reply,
                                              Bytes last_tracking, Faults& chance);

}  // namespace tubed::aurora::emulator
