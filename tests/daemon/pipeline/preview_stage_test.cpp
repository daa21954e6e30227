#include "daemon/pipeline/preview_stage.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

struct Shown final : PreviewOutlet {
  void put(std::size_t camera, const ImageFrame& frame) noexcept override {
    cameras.push_back(camera);
    newest = frame;
  }
  void beat() noexcept override { ++beats; }
  std::vector<std::size_t> cameras;
  ImageFrame newest;
  int beats = 0;
};

struct PreviewBench {
  PreviewBench() {
    mailbox.for_each_slot([](ImageFrame& slot) { slot.reserve(4, 2); });
    frame.reserve(4, 2);
    frame.fluoroscopy_on = true;
    frame.pixels = {1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 9, 9, 9, 9, 9};
    frame.frame_number = 7;
    frame.origin = Origin::kReplayed;
    frame.geometry = ViewGeometry{.fx = 1234, .sigma = {}};
  }
  FakeClock clock;
  TripleBuffer<ImageFrame> mailbox;
  Doorbell bell;
  Shown shown;
  ImageFrame frame;
};

TEST(Preview, AnImageComesAsItWas) {
  PreviewBench bench;
  PreviewTap tap(bench.mailbox, bench.bell);
  PreviewStage stage({&bench.mailbox}, bench.shown, bench.bell);
  tap.offer(bench.frame, bench.clock.now());
  EXPECT_TRUE(stage.step(bench.clock));
  ASSERT_EQ(bench.shown.cameras, (std::vector<std::size_t>{0}));
  EXPECT_EQ(bench.shown.newest.frame_number, 7U);
  EXPECT_EQ(bench.shown.newest.origin, Origin::kReplayed);
  ASSERT_TRUE(bench.shown.newest.geometry);
  EXPECT_EQ(bench.shown.newest.geometry->fx, 1234);
  EXPECT_TRUE(std::equal(bench.frame.pixels.begin(), bench.frame.pixels.begin() + 8,
                         bench.shown.newest.pixels.begin()));
}

TEST(Preview, OfThirtyImagesASecondFifteenAreShown) {
  PreviewBench bench;
  PreviewTap tap(bench.mailbox, bench.bell);
  PreviewStage stage({&bench.mailbox}, bench.shown, bench.bell);
  const MonotonicTime begin = bench.clock.now();
  for (int i = 0; i < 300; ++i) {
    tap.offer(bench.frame, begin + std::chrono::microseconds(33'333 * i));
    stage.step(bench.clock);
  }
  EXPECT_NEAR(static_cast<double>(bench.shown.cameras.size()), 150, 5);
}

TEST(Preview, AnImageThatIsLargerThanTheCamerasHasNoPixels) {
  PreviewBench bench;
  PreviewTap tap(bench.mailbox, bench.bell);
  PreviewStage stage({&bench.mailbox}, bench.shown, bench.bell);
  bench.frame.reserve(100, 100);
  tap.offer(bench.frame, bench.clock.now());
  stage.step(bench.clock);
  EXPECT_FALSE(bench.shown.newest.fluoroscopy_on);
}

TEST(Preview, TheOutletIsToldThatThereIsADaemonThoughThereIsNoImage) {
  PreviewBench bench;
  PreviewStage stage({&bench.mailbox}, bench.shown, bench.bell);
  EXPECT_FALSE(stage.step(bench.clock));
  EXPECT_EQ(bench.shown.beats, 1);
}

}  // namespace
}  // namespace tubed
