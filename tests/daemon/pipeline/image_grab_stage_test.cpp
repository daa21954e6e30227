#include "daemon/pipeline/image_grab_stage.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

/// Gives a frame at every call and remembers where its pixels were asked for.
class PlacedImageSource final : public ImageSource {
 public:
  explicit PlacedImageSource(const std::uint8_t*& place) : place_(place) {}
  OpenResult open() override { return {true, {}}; }
  ReadOutcome read(ImageFrame& frame, MonotonicTime /*deadline*/) noexcept override {
    place_ = frame.pixels.data();
    frame.frame_number = ++number_;
    return ReadOutcome::kFrame;
  }
  void close() noexcept override {}

 private:
  const std::uint8_t*& place_;
  std::uint32_t number_ = 0;
};

TEST(ImageGrabStage, TheFilterSeesThePixelsWhereTheSourcePutThem) {
  const std::uint8_t* place = nullptr;
  TripleBuffer<ImageFrame> mailbox;
  mailbox.for_each_slot([](ImageFrame& frame) { frame.reserve(40, 30); });
  TripleBuffer<MonotonicTime> announcement;
  Doorbell bell;
  ImageGrabStage stage(std::make_unique<PlacedImageSource>(place), PipelineSettings{}, mailbox, announcement,
                       bell);
  FakeClock clock;
  std::set<const std::uint8_t*> places;
  for (std::uint32_t number = 1; number <= 6; ++number) {
    stage.wait(clock);
    ASSERT_TRUE(stage.step(clock));
    ASSERT_TRUE(mailbox.fetch());
    EXPECT_EQ(mailbox.front().frame_number, number);
    EXPECT_EQ(mailbox.front().pixels.data(), place) << "the image was copied";
    places.insert(place);
  }
  EXPECT_GE(places.size(), 2U) << "the source writes into what the filter reads";
}

}  // namespace
}  // namespace tubed
