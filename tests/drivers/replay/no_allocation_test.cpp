// Counts calls of operator new in this executable: read() may not make any.
#include <gtest/gtest.h>

#include "drivers/replay/replay_driver.hpp"
#include "tests/drivers/replay/small_sequence.hpp"
#include "tests/support/counted_allocations.hpp"

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
  const ReadOutcome measured = tracker->read(em);
  const ReadOutcome exposed = camera->read(image);
  const ReadOutcome ended = camera->read(image);
  const long counted = allocations;

  EXPECT_EQ(counted, 0);
  EXPECT_EQ(measured, ReadOutcome::kFrame);
  EXPECT_EQ(exposed, ReadOutcome::kFrame);
  EXPECT_EQ(ended, ReadOutcome::kEnded);
}

}  // namespace
}  // namespace tubed
