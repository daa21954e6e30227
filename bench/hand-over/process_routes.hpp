// Bytes from one process to others: a sample is the number, then as many bytes as the payload has.
#pragma once

#include <cstddef>
#include <filesystem>

#include "bench/support/exchange.hpp"

namespace tubed {

/// Our sealed ring; its socket is in `folder`. Receivers copy what they take.
Route shm_ring(const std::filesystem::path& folder, std::size_t payload_bytes);

/// A Unix stream socket to each receiver: how a frame grabber's program would otherwise give its images.
Route unix_socket(const std::filesystem::path& folder, std::size_t payload_bytes);

}  // namespace tubed
