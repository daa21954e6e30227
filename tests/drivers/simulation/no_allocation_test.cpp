// Counts calls of operator new in this executable: read() may not make any.
#include <gtest/gtest.h>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed {
namespace {

void expect_no_allocations(const DriverSettings& settings) {
  const RoomDescription room = paper_room();
  const auto tracker = make_simulation_em_source(room, settings);
  const auto camera = make_simulation_image_source(room, settings, 0);
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_TRUE(camera->open().ok);
  EmFrame em;
  ImageFrame image;
  image.reserve(400, 600);
  const MonotonicTime timeout = monotonic_now() + std::chrono::seconds(30);
  ASSERT_GT(allocations, 0) << "the counter counts";

  allocations = 0;
  int frames = 0;
  for (int round = 0; round < 5; ++round) {
    frames += read_until(*tracker, em, timeout) == ReadOutcome::kFrame ? 1 : 0;
    frames += read_until(*camera, image, timeout) == ReadOutcome::kFrame ? 1 : 0;
  }
  const long counted = allocations;

  EXPECT_EQ(counted, 0);
  EXPECT_EQ(frames, 10);
}

TEST(SimulationReads, AllocateNothing) {
  expect_no_allocations(default_settings().with("em_rate_hz", 400.0).with("frame_rate_hz", 100.0));
}

TEST(SimulationReads, AllocateNothingWhileTheViewMoves) {
  expect_no_allocations(default_settings()
                            .with("em_rate_hz", 400.0)
                            .with("frame_rate_hz", 100.0)
                            .with("swing_deg", 30.0)
                            .with("swing_every_s", 0.5));
}

TEST(SimulationReads, AllocateNothingInARoomWithMistakes) {
  expect_no_allocations(
      default_settings()
          .with("em_rate_hz", 400.0)
          .with("frame_rate_hz", 100.0)
          .with("mistakes",
                "registration=6,2 offsets=5 focal=1.08 clock=20 field-jump=4,0 averaging=0.5 polarity "
                "mirrored coil-order coil-direction"));
}

}  // namespace
}  // namespace tubed
