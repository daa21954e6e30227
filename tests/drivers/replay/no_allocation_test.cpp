// Counts calls of operator new in this executable: read() may not make any.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "drivers/replay/replay_driver.hpp"
#include "tests/drivers/replay/small_sequence.hpp"

namespace {
thread_local int allocations = 0;
}

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) {
    return memory;
  }
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace tubed {
namespace {

TEST(ReplayReads, AllocateNothing) {
  const TemporaryFolder folder;
  write_small_sequence(folder);
  const RoomDescription room = read_sequence(folder.path()).room;
  const DriverSettings settings({{"folder", folder.path().string()},
                                 {"loop", false},
                                 {"start_monotonic_ns", std::int64_t{1}},
                                 {"memory_limit_mb", std::int64_t{10}}});
  const auto tracker = make_replay_em_source(room, settings);
  const auto camera = make_replay_image_source(room, settings, 0);
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_TRUE(camera->open().ok);
  EmFrame em;
  ImageFrame image;
  image.reserve(4, 3);
  ASSERT_GT(allocations, 0) << "the counter counts";

  allocations = 0;
  const ReadOutcome measured = tracker->read(em, MonotonicTime{});
  const ReadOutcome exposed = camera->read(image, MonotonicTime{});
  const ReadOutcome ended = camera->read(image, MonotonicTime{});
  const int counted = allocations;

  EXPECT_EQ(counted, 0);
  EXPECT_EQ(measured, ReadOutcome::kFrame);
  EXPECT_EQ(exposed, ReadOutcome::kFrame);
  EXPECT_EQ(ended, ReadOutcome::kEnded);
}

}  // namespace
}  // namespace tubed
