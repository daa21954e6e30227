// Fast DDS, where it is installed: a block of the same size, reliable, keep last 1, taken in a listener.
#pragma once

#include "bench/support/exchange.hpp"

namespace tubed {

/// As it comes: shared memory and data sharing between processes of one machine.
Route fastdds_as_it_comes();

/// UDP only.
Route fastdds_udp();

}  // namespace tubed
