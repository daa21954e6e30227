// Where a client listens.
#pragma once

#include <cstddef>
#include <string>

namespace tubed {

/// Which daemon and which of its instruments. The defaults are the daemon's.
struct Subscription {
  int domain = 0;                        ///< DDS domain, 0 .. 230
  std::string partition{};               ///< the room; empty = the default partition
  std::string network_interface = "lo";  ///< "lo", or the name or address of the interface towards the daemon
  std::string instrument_id{};           ///< empty = every instrument
  std::string security{};  ///< folder of this program's keys (`tubectl keys`); empty = no DDS Security
  std::size_t max_instruments = 8;  ///< remembered at a time; samples of further ones are refused
  double max_rate_hz = 120;         ///< a sequence number that grows faster is no daemon's: 30 Hz, and room
};

}  // namespace tubed
