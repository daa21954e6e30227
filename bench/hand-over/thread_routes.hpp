// From one thread to another of the same process.
#pragma once

#include "bench/support/exchange.hpp"

namespace tubed {

/// Our triple buffer and doorbell, with an estimate in each slot.
Route triple_buffer();

/// What one writes without thinking about it: a copy under a std::mutex and a std::condition_variable.
Route mutex_and_condition();

}  // namespace tubed
