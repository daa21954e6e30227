// Counts what a hot thread must not do. The counters are always on, in the product too, so that "no
// allocation after start-up" is a figure of every running daemon (TubeHealth) and not a belief.
#pragma once

#include <cstdint>

namespace tubed {

/// What the calling thread did so far. Zero for ever in builds with a sanitizer, which owns these functions.
struct ThreadCosts {
  std::uint64_t allocations = 0;  ///< malloc, calloc, realloc, aligned_alloc, operator new, ...
  std::uint64_t locks = 0;        ///< pthread_mutex_lock, pthread_rwlock_*lock
  std::uint64_t exceptions = 0;   ///< thrown
};

ThreadCosts costs_of_this_thread() noexcept;

/// False in builds with a sanitizer.
bool costs_are_counted() noexcept;

}  // namespace tubed
