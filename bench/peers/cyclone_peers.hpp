// Cyclone DDS as somebody else would use it for the same type: the peers of our publishing.
#pragma once

#include <filesystem>

#include "bench/support/child_process.hpp"
#include "bench/support/exchange.hpp"

namespace tubed {

/// A bare writer over UDP on lo, reliable, keep last 1, all else by default; the reader sleeps in a wait set.
Route cyclone_udp();

/// Cyclone's shared memory (iceoryx) with the same type. It has a bounded string, so that Cyclone serialises
/// it into the shared memory; the reader takes it in a listener. Needs a running RouDi.
Route cyclone_shared_memory();

/// The fastest that Cyclone's shared memory can: a type of the same size without a string, filled in place in
/// a loan, taken as a loan in a listener. Needs a running RouDi.
Route cyclone_loans();

/// Whether `iox-roudi` (Debian package iceoryx) is installed.
bool has_roudi();

/// Starts RouDi with pools for TubeEstimate; waits until it is ready. Throws std::runtime_error with its
/// words when it is not.
ChildProcess start_roudi(const std::filesystem::path& folder);

}  // namespace tubed
