#include "daemon/pipeline/image_grab_stage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "daemon/pipeline/stage_thread.hpp"
#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

/// Gives a frame at every call and remembers where its pixels were asked for.
class PlacedImageSource final : public ImageSource {
 public:
  explicit PlacedImageSource(const std::uint8_t*& place) : place_(place) {}
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(ImageFrame& frame) noexcept override {
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
  stage.step(clock);  // opens the source
  std::set<const std::uint8_t*> places;
  for (std::uint32_t number = 1; number <= 6; ++number) {
    clock.advance(std::chrono::milliseconds(33));
    stage.wait(clock);
    ASSERT_TRUE(stage.step(clock));
    ASSERT_TRUE(mailbox.fetch());
    EXPECT_EQ(mailbox.front().frame_number, number);
    EXPECT_EQ(mailbox.front().pixels.data(), place) << "the image was copied";
    places.insert(place);
  }
  EXPECT_GE(places.size(), 2U) << "the source writes into what the filter reads";
}

/// Gives images of 1, all white where the mask is.
class WrittenOnImageSource final : public ImageSource {
 public:
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(ImageFrame& frame) noexcept override {
    frame.fluoroscopy_on = true;
    std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{1});
    std::fill_n(frame.pixels.begin(), 40 * 5, std::uint8_t{255});
    return ReadOutcome::kFrame;
  }
  void close() noexcept override {}
};

TEST(ImageGrabStage, WhatIsMaskedGoesNoFurther) {
  CameraCalibration camera;
  camera.width = 40;
  camera.height = 30;
  camera.masks = {0, 0, 40, 5};
  TripleBuffer<ImageFrame> mailbox;
  TripleBuffer<ImageFrame> watched;
  for (TripleBuffer<ImageFrame>* const frames : {&mailbox, &watched}) {
    frames->for_each_slot([](ImageFrame& frame) { frame.reserve(40, 30); });
  }
  TripleBuffer<MonotonicTime> announcement;
  Doorbell bell;
  Doorbell view_bell;
  ImageGrabStage stage(std::make_unique<WrittenOnImageSource>(), PipelineSettings{}, mailbox, announcement,
                       bell, {&watched, &view_bell}, {}, std::make_unique<MaskCover>(camera));
  FakeClock clock;
  stage.step(clock);
  ASSERT_TRUE(stage.step(clock));
  for (TripleBuffer<ImageFrame>* const frames : {&mailbox, &watched}) {
    ASSERT_TRUE(frames->fetch());
    const auto& pixels = frames->front().pixels;
    EXPECT_TRUE(std::all_of(pixels.begin(), pixels.begin() + 40 * 30, [](auto pixel) { return pixel == 1; }));
  }
}

/// Stamps every image with the same time.
class StampingImageSource final : public ImageSource {
 public:
  explicit StampingImageSource(MonotonicTime stamp) : stamp_(stamp) {}
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(ImageFrame& frame) noexcept override {
    frame.exposure = stamp_;
    return ReadOutcome::kFrame;
  }
  void close() noexcept override {}

 private:
  MonotonicTime stamp_;
};

/// The exposure that comes out 50 ms after such a stamp.
MonotonicTime exposure_of(MonotonicTime stamp, std::chrono::nanoseconds time_offset) {
  TripleBuffer<ImageFrame> mailbox;
  TripleBuffer<MonotonicTime> announcement;
  Doorbell bell;
  ImageGrabStage stage(std::make_unique<StampingImageSource>(stamp), PipelineSettings{}, mailbox,
                       announcement, bell, {}, time_offset);
  FakeClock clock;
  stage.step(clock);  // opens the source
  clock.advance(stamp + std::chrono::milliseconds(50) - clock.now());
  stage.step(clock);
  EXPECT_TRUE(mailbox.fetch() && announcement.fetch());
  EXPECT_EQ(mailbox.front().exposure, announcement.front());
  return mailbox.front().exposure;
}

TEST(ImageGrabStage, WhatStampsAreLateByIsTakenOffAndNothingIsExposedAfterItHasCome) {
  using std::chrono::milliseconds;
  const MonotonicTime stamp = from_ns(10'000'000'000);

  EXPECT_EQ(exposure_of(stamp, milliseconds(45)), stamp - milliseconds(45));
  EXPECT_EQ(exposure_of(stamp, milliseconds(-30)), stamp + milliseconds(30));
  EXPECT_EQ(exposure_of(stamp, milliseconds(-80)), stamp + milliseconds(50));
}

TEST(ImageGrabStage, ImagesAtTenTimesTheRateAreThinnedOutCountedAndTold) {
  const std::uint8_t* place = nullptr;
  TripleBuffer<ImageFrame> mailbox;
  TripleBuffer<MonotonicTime> announcement;
  Doorbell bell;
  ImageGrabStage stage(std::make_unique<PlacedImageSource>(place), PipelineSettings{}, mailbox, announcement,
                       bell);
  FakeClock clock;
  stage.step(clock);  // opens the source
  std::uint32_t newest = 0;
  for (std::uint32_t number = 1; number <= 300; ++number) {
    stage.wait(clock);
    if (stage.step(clock) && mailbox.fetch()) {
      EXPECT_EQ(mailbox.front().frame_number, number) << "the newest";
      newest = number;
    }
    clock.advance(std::chrono::microseconds(3333));
  }
  EXPECT_GT(newest, 280U);
  StageReport report;
  stage.describe(report);
  EXPECT_NEAR(static_cast<double>(report.outputs), 30, 2);
  EXPECT_EQ(report.outputs + report.dropped, 300U);
  EXPECT_NE(std::string(report.why.data()).find("faster than daemon.rate_hz = 30"), std::string::npos);
  EXPECT_EQ(report.state, StageState::kRunning);
}

// Also of an image that is left out because they come too fast, and of one that cannot be used.
TEST(ImageGrabStage, BusyIsTheTimeOfReadingNotOfWaitingOrOpening) {
  for (const ReadOutcome outcome : {ReadOutcome::kFrame, ReadOutcome::kRefused}) {
    for (const int work_ms : {1, 2, 8}) {
      TripleBuffer<ImageFrame> mailbox;
      TripleBuffer<MonotonicTime> announcement;
      Doorbell bell;
      FakeClock clock;
      auto source = std::make_unique<WorkingSource<ImageSource, ImageFrame>>(
          clock, std::chrono::milliseconds(2), std::chrono::milliseconds(work_ms));
      source->outcome = outcome;
      ImageGrabStage stage(std::move(source), PipelineSettings{}, mailbox, announcement, bell);
      StageReport report;
      for (int i = 0; i < 41; ++i) {  // one to open; after each image a look whether there is another
        turn(stage, clock, report);
      }
      EXPECT_EQ(report.busy.count, 20U);
      EXPECT_EQ(report.busy.max_ns, work_ms * 1'000'000);
      EXPECT_EQ(*std::max_element(report.busy.buckets.begin(), report.busy.buckets.end()), 20U)
          << "all alike";
    }
  }
}

TEST(ImageGrabStage, WaitingReadsNothing) {
  const std::uint8_t* place = nullptr;
  TripleBuffer<ImageFrame> mailbox;
  mailbox.for_each_slot([](ImageFrame& frame) { frame.reserve(40, 30); });
  TripleBuffer<MonotonicTime> announcement;
  Doorbell bell;
  ImageGrabStage stage(std::make_unique<PlacedImageSource>(place), PipelineSettings{}, mailbox, announcement,
                       bell);
  FakeClock clock;
  stage.step(clock);  // opens the source
  stage.wait(clock);
  stage.wait(clock);
  EXPECT_EQ(place, nullptr);
  EXPECT_TRUE(stage.step(clock));
  EXPECT_NE(place, nullptr);
}

}  // namespace
}  // namespace tubed
