#include "daemon/memory_lock.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <string>
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

void populate_heap() {
#ifdef MADV_POPULATE_WRITE
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    void *begin = nullptr, *end = nullptr;
    if (line.ends_with("[heap]") && std::sscanf(line.c_str(), "%p-%p", &begin, &end) == 2) {
      madvise(begin, static_cast<std::size_t>(static_cast<char*>(end) - static_cast<char*>(begin)),
              MADV_POPULATE_WRITE);
    }
  }
#endif
}

}  // namespace tubed
