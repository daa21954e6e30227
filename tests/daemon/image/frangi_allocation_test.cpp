// Counts calls of operator new in this executable: the filter may not make any.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "tests/daemon/image/frangi_bed.hpp"

namespace {
std::size_t allocations = 0;
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace tubed {
namespace {

TEST(Frangi, NeverAllocatesOnceItIsMade) {
  FrangiSettings settings;
  settings.smoothing = FrangiSmoothing::kInteger16;
  FrangiFilter filter(kWidth, kHeight, settings);
  OwnedMaps maps;
  const auto bytes = tubes<std::uint8_t>();
  const auto words = tubes<std::uint16_t>();
  const auto floats = tubes<float>();
  const std::size_t before = allocations;
  filter.filter_tiles(bytes, kTiles, maps.all());
  filter.filter(bytes, maps.all());
  filter.filter(words, maps.vesselness);
  filter.filter(floats, maps.all());
  filter.filter_tiles(floats, kTiles, maps.all());
  EXPECT_EQ(allocations - before, 0U);
}

}  // namespace
}  // namespace tubed
