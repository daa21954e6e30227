#include "daemon/pipeline/allocation_counter.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TUBED_COUNTS_COSTS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TUBED_COUNTS_COSTS 0
#endif
#endif
#ifndef TUBED_COUNTS_COSTS
#define TUBED_COUNTS_COSTS 1
#endif

#if TUBED_COUNTS_COSTS
#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <typeinfo>
#endif

namespace tubed {

namespace {
// initial-exec: reading it can never itself allocate.
__attribute__((tls_model("initial-exec"))) thread_local ThreadCosts costs;
}  // namespace

ThreadCosts costs_of_this_thread() noexcept { return costs; }
bool costs_are_counted() noexcept { return TUBED_COUNTS_COSTS != 0; }

}  // namespace tubed

#if TUBED_COUNTS_COSTS
// The C library's entry points, defined in the program so that every library in it calls these; each counts
// and goes on to glibc's own. glibc documents that malloc may be replaced this way ("Replacing malloc").
// NOLINTBEGIN(readability-identifier-naming,bugprone-reserved-identifier)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++tubed::costs.allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++tubed::costs.allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  ++tubed::costs.allocations;
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  ++tubed::costs.allocations;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++tubed::costs.allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t size) {
  ++tubed::costs.allocations;
  void* memory = __libc_memalign(alignment, size);
  if (memory == nullptr) {
    return ENOMEM;
  }
  *result = memory;
  return 0;
}
}

namespace {
template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));  // NOLINT: the only way dlsym is used
}
using Lock = int (*)(pthread_mutex_t*);
using ReadWriteLock = int (*)(pthread_rwlock_t*);
using Throw = void (*)(void*, std::type_info*, void (*)(void*));
// Plain pointers, no guarded statics: a guard would itself lock. Two threads may both look a name up; they
// find the same.
Lock real_lock = nullptr;
ReadWriteLock real_read_lock = nullptr;
ReadWriteLock real_write_lock = nullptr;

__attribute__((constructor(101))) void find_real_locks() {
  real_lock = next<Lock>("pthread_mutex_lock");
  real_read_lock = next<ReadWriteLock>("pthread_rwlock_rdlock");
  real_write_lock = next<ReadWriteLock>("pthread_rwlock_wrlock");
}
}  // namespace

extern "C" {
int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  ++tubed::costs.locks;
  if (real_lock == nullptr) {
    find_real_locks();
  }
  return real_lock(mutex);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  ++tubed::costs.locks;
  if (real_read_lock == nullptr) {
    find_real_locks();
  }
  return real_read_lock(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  ++tubed::costs.locks;
  if (real_write_lock == nullptr) {
    find_real_locks();
  }
  return real_write_lock(lock);
}
[[noreturn]] void __cxa_throw(void* thrown, std::type_info* type, void (*destructor)(void*)) {
  ++tubed::costs.exceptions;
  static const auto real_throw = next<Throw>("__cxa_throw");
  real_throw(thrown, type, destructor);
  std::abort();
}
}
// NOLINTEND(readability-identifier-naming,bugprone-reserved-identifier)
#endif
