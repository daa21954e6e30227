#include "daemon/memory_lock.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <cerrno>
#include <system_error>

namespace tubed {

std::string lock_memory() {
  // Programs and libraries are fetched from the disk now, all of them. What is mapped later is zeros: each
  // page stays from its first use on, without the 8 MB that every thread's stack could have at most.
  if (mlockall(MCL_CURRENT) != 0 || mlockall(MCL_FUTURE | MCL_ONFAULT) != 0) {
    return "locking the memory refused (" + std::generic_category().message(errno) +
           "); raise RLIMIT_MEMLOCK (LimitMEMLOCK=infinity in the unit, or ulimit -l unlimited)";
  }
  // What is given back would have to be fetched, and so waited for, again.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  return {};
}

}  // namespace tubed
