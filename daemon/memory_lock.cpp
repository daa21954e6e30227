#include "daemon/memory_lock.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

namespace tubed {

namespace {

/// Direct solvers of linear systems, and what they need: Ceres is linked with them, and tubed asks for none.
constexpr std::array<std::string_view, 9> kIdleLibraries{
    "/liblapack.so",   "/libblas.so",    "/libatlas.so", "/libopenblas", "/libgfortran.so",
    "/libquadmath.so", "/libcholmod.so", "/libmetis.so", "/libspqr.so"};

/// Of a line of /proc/self/maps.
struct Mapping {
  void* begin = nullptr;
  void* end = nullptr;
  std::array<char, 5> may{};  ///< "r-xp"

  explicit Mapping(const std::string& line) {
    std::sscanf(line.c_str(), "%p-%p %4s", &begin, &end, may.data());
  }
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(static_cast<char*>(end) - static_cast<char*>(begin));
  }
};

/// Not what nobody may read, nor the kernel's [vvar] and [vdso]; of what has no file the libraries' own
/// zeros, which are less than the stack of a thread that is there already.
bool is_fetched(const std::string& line, const Mapping& mapping) {
  constexpr std::size_t kMaxZeros = 1 << 20;
  const bool has_name = line.find_first_of("/[") != std::string::npos;
  const bool is_idle = std::ranges::any_of(
      kIdleLibraries, [&](std::string_view name) { return line.find(name) != std::string::npos; });
  return mapping.may[0] == 'r' && !is_idle && line.find("[v") == std::string::npos &&
         (has_name || mapping.size() <= kMaxZeros);
}

template <typename Visit>
void for_each_mapping(const Visit& visit) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) visit(line, Mapping(line));
}

}  // namespace

std::string lock_memory() {
  // Programs and libraries are fetched from the disk now, but for idle ones. What is mapped later is zeros:
  // each page stays from its first use on, without the 8 MB that every thread's stack could have at most.
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) {
    return "locking the memory refused (" + std::generic_category().message(errno) +
           "); raise RLIMIT_MEMLOCK (LimitMEMLOCK=infinity in the unit, or ulimit -l unlimited)";
  }
  // Nothing is lost where this is refused: what is not fetched now is locked from its first use on.
  for_each_mapping([](const std::string& line, const Mapping& mapping) {
    if (is_fetched(line, mapping)) mlock(mapping.begin, mapping.size());
  });
  // What is given back would have to be fetched, and so waited for, again.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  return {};
}

void populate_heap() {
#ifdef MADV_POPULATE_WRITE
  for_each_mapping([](const std::string& line, const Mapping& mapping) {
    if (line.ends_with("[heap]")) madvise(mapping.begin, mapping.size(), MADV_POPULATE_WRITE);
  });
#endif
}

}  // namespace tubed
