// Counts calls of operator new, by thread. Included by one file of a test program, whose operators new and
// delete these are.
#pragma once

#include <cstdlib>
#include <new>

namespace tubed {

inline thread_local bool counting = true;  ///< off while a test does what may allocate
inline thread_local long allocations = 0;  ///< of this thread, while counting

}  // namespace tubed

// Out of line: once inlined, GCC takes malloc and free behind new and delete for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  tubed::allocations += tubed::counting ? 1 : 0;
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) {
    return memory;
  }
  throw std::bad_alloc();
}
// The library's own calls the one above; a sanitizer's does not, and finds that what it gave is freed.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t& /*unused*/) noexcept {
  tubed::allocations += tubed::counting ? 1 : 0;
  return std::malloc(size == 0 ? 1 : size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
