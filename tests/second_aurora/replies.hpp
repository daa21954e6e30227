// A measurement as TX and BX report it (README.md, Tracking replies).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/second_aurora/port_table.hpp"
#include "tests/second_aurora/settings.hpp"
#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

struct TrackingReply {
  std::vector<const Handle*> handles;  // in the order of the reply
  const Truth* measurement = nullptr;  // nullptr: every coil MISSING with frame 0
  bool reports_out_of_volume = false;  // option 0800
  std::uint32_t extra_port_status = 0;
  std::uint16_t system_status = 0;
};

// Payload without CRC and CR.
std::string in_text(const TrackingReply& reply);
// The whole reply with header and both CRCs.
Bytes in_binary(const TrackingReply& reply);
// Body in a frame of C4 A5, length, CRC, and the body's CRC behind it.
Bytes binary_framed(const Bytes& body);

}  // namespace tubed::second_aurora
