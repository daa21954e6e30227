#include "daemon/memory_lock.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <cerrno>
#include <system_error>

namespace tubed {

std::string lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    return "locking the memory refused (" + std::generic_category().message(errno) +
           "); raise RLIMIT_MEMLOCK (LimitMEMLOCK=infinity in the unit, or ulimit -l unlimited)";
  }
  // What is given back would have to be fetched, and so waited for, again.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  return {};
}

}  // namespace tubed
