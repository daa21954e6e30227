// The source at a card that behaves, and at one that does not.
#include "drivers/v4l2/v4l2_image_source.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/v4l2/source_bench.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(V4l2ImageSource, DeliversEveryPictureOfTheCardOnceWithItsTime) {
  SourceBench bench;
  bench.card.stamp_shift = -milliseconds(3);
  bench.open();

  bench.run_for(seconds(2));

  ASSERT_GE(bench.frames.size(), 58U);
  for (std::size_t k = 0; k < bench.frames.size(); ++k) {
    const ImageFrame& frame = bench.frames[k];
    ASSERT_EQ(frame.pixels[0], FakeCard::value_of(static_cast<std::uint32_t>(k)));
    ASSERT_EQ(frame.frame_number, k + 1);
    ASSERT_LT(std::abs((frame.received - frame.exposure - milliseconds(3)).count()),
              1000);  // stamps are in us
    ASSERT_EQ(frame.origin, Origin::kDevice);
    ASSERT_TRUE(frame.fluoroscopy_on);
  }
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  EXPECT_EQ(bench.words(), "");
}

TEST(V4l2ImageSource, ALateReaderGetsTheNewestPicture) {
  SourceBench bench;
  bench.open();
  bench.run_for(milliseconds(500));
  bench.frames.clear();

  bench.card.run_to(bench.card.time + milliseconds(101));  // three pictures meanwhile
  ASSERT_EQ(bench.source->read(bench.frame), ReadOutcome::kFrame);

  EXPECT_EQ(bench.frame.pixels[0], FakeCard::value_of(bench.card.sequence - 1));
  EXPECT_EQ(bench.source->counts().overtaken, 2U);
  EXPECT_EQ(bench.source->read(bench.frame), ReadOutcome::kNothing);
}

TEST(V4l2ImageSource, EveryBufferGoesBackToTheCardHoweverLateTheReader) {
  SourceBench bench;
  bench.open();
  bench.run_for(milliseconds(500));
  for (int late = 0; late < 20; ++late) {
    bench.card.run_to(bench.card.time + milliseconds(101));
    bench.source->read(bench.frame);
    bench.card.next_flags = late % 2 == 0 ? V4L2_BUF_FLAG_ERROR : 0;  // refused ones, too
  }

  EXPECT_EQ(bench.card.queued.size(), 4U);
  EXPECT_EQ(bench.source->counts().lost, 0U);
}

TEST(V4l2ImageSource, PicturesThatTheCardLostAreCountedAndToldForAWhile) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.lose_next = 2;

  bench.run_for(milliseconds(200));

  EXPECT_EQ(bench.source->counts().lost, 2U);
  EXPECT_TRUE(contains(bench.words(), "pictures are lost")) << bench.words();
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  EXPECT_EQ(bench.frames.back().frame_number, bench.card.sequence);
  bench.run_for(seconds(6));
  EXPECT_EQ(bench.words(), "");
}

TEST(V4l2ImageSource, AHungDriverIsToldWithin100MillisecondsAndStartedAnew) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.hangs = true;
  const MonotonicTime last = bench.frames.back().received;

  bench.time_until_said("its driver hangs");

  EXPECT_LE(bench.card.time - last, milliseconds(100));
  EXPECT_EQ(bench.state(), DeviceState::kReconnecting);
  bench.run_for(seconds(10));
  EXPECT_GT(bench.source->counts().starts, 2U) << "the stream is started anew";
  EXPECT_LT(bench.source->counts().starts, 9U) << "with growing pauses";
  bench.card.hangs = false;
  bench.run_for(seconds(5));
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  EXPECT_EQ(bench.words(), "");
}

TEST(V4l2ImageSource, AnUnpluggedCardIsToldAtOnceAndUsedAgainWhenItIsBack) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.is_plugged = false;

  EXPECT_LE(bench.time_until_said("/dev/video0 has gone"), milliseconds(100));
  EXPECT_EQ(bench.state(), DeviceState::kReconnecting);
  EXPECT_FALSE(bench.card.is_open) << "its number would not be free for it otherwise";
  bench.run_for(seconds(60));
  EXPECT_TRUE(contains(bench.words(), "/dev/video0 is not there")) << bench.words();
  bench.card.is_plugged = true;
  bench.frames.clear();
  const MonotonicTime plugged = bench.card.time;
  bench.run_for(milliseconds(200));
  ASSERT_FALSE(bench.frames.empty());
  EXPECT_LE(bench.frames.front().received - plugged, milliseconds(140)) << "a look and a picture later";
  EXPECT_GT(bench.frames.front().frame_number, 29U) << "the count goes on";
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
}

TEST(V4l2ImageSource, ALostSignalIsToldWithin100MillisecondsAndNoPictureIsDeliveredUntilItIsBack) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.input_status = V4L2_IN_ST_NO_SIGNAL;  // many cards go on with pictures of one colour

  EXPECT_LE(bench.time_until_said("no signal"), milliseconds(100));
  bench.frames.clear();
  bench.run_for(seconds(20));
  EXPECT_TRUE(bench.frames.empty());
  EXPECT_EQ(bench.state(), DeviceState::kReconnecting);
  bench.card.input_status = 0;
  bench.run_for(milliseconds(200));
  EXPECT_FALSE(bench.frames.empty());
}

TEST(V4l2ImageSource, ADigitalInputIsAskedForItsSignal) {
  for (const auto& [error, words] :
       {std::pair{ENOLINK, "no signal"}, {ENOLCK, "not stable"}, {ERANGE, "does not take"}}) {
    SourceBench bench;
    bench.card.input_capabilities = V4L2_IN_CAP_DV_TIMINGS;
    bench.card.timings_error = error;
    bench.open();
    bench.run_for(seconds(1));
    EXPECT_TRUE(contains(bench.words(), words)) << bench.words();
    EXPECT_EQ(bench.state(), DeviceState::kStarting);
    bench.card.timings_error = 0;
    bench.run_for(seconds(3));
    EXPECT_EQ(bench.state(), DeviceState::kRunning);
  }
}

TEST(V4l2ImageSource, AChangedResolutionIsToldWithBothSizesAndUsedAgainWhenItIsBack) {
  SourceBench bench;
  bench.card.has_size = [&](auto, int width, int height) {
    return width == bench.card.width && height == bench.card.height;
  };
  bench.settings.request.size = {96, 64};
  bench.open();
  bench.run_for(seconds(1));
  bench.card.width = 128;
  bench.card.signal_changed = true;
  bench.frames.clear();

  EXPECT_LE(bench.time_until_said("128 x 64 pixels, asked for were 96 x 64"), milliseconds(200));
  bench.run_for(seconds(1));
  EXPECT_TRUE(bench.frames.empty());
  bench.card.width = 96;
  bench.run_for(seconds(3));
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  EXPECT_FALSE(bench.frames.empty());
}

TEST(V4l2ImageSource, PicturesThatBecomeAnotherSizeThanTheCamerasAreToldWithAllSizes) {
  SourceBench bench;
  bench.settings.shape.decimation = 2;
  bench.open();

  bench.run_for(seconds(1));

  EXPECT_TRUE(contains(bench.words(), "96 x 64 pixels, which become 48 x 32; camera A has 96 x 64"))
      << bench.words();
  EXPECT_TRUE(bench.frames.empty());
}

TEST(V4l2ImageSource, DamagedAndShortPicturesAreRefusedInWordsAndTheNextIsDelivered) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.next_flags = V4L2_BUF_FLAG_ERROR;
  bench.run_for(milliseconds(70));
  EXPECT_TRUE(contains(bench.words(), "refused: the card says that it is damaged")) << bench.words();
  bench.card.next_flags = 0;
  bench.card.short_by = 1;
  bench.run_for(milliseconds(70));
  EXPECT_TRUE(contains(bench.words(), "refused: it has fewer bytes")) << bench.words();
  bench.run_for(milliseconds(100));
  EXPECT_EQ(bench.state(), DeviceState::kReconnecting) << "refused pictures are no images";
  bench.card.short_by = 0;
  bench.run_for(milliseconds(70));
  EXPECT_EQ(bench.words(), "");
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  EXPECT_GE(bench.source->counts().refused, 6U);
}

TEST(V4l2ImageSource, AStampOfTheFutureIsTakenForTheArrivalAndOneThatStandsStillIsRefused) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.stamp_shift = milliseconds(20);
  bench.run_for(milliseconds(70));
  EXPECT_EQ(bench.frames.back().exposure, bench.frames.back().received);
  EXPECT_TRUE(contains(bench.words(), "ahead of their arrival")) << bench.words();
  bench.card.stamp_shift = -seconds(2);
  bench.run_for(milliseconds(70));
  EXPECT_TRUE(contains(bench.words(), "not after")) << bench.words();
}

TEST(V4l2ImageSource, WithoutTimeStampsTheArrivalCountsAndThatIsTold) {
  SourceBench bench;
  bench.card.stamp_kind = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  bench.open();

  bench.run_for(seconds(1));

  ASSERT_FALSE(bench.frames.empty());
  EXPECT_EQ(bench.frames.back().received, bench.frames.back().exposure);
  EXPECT_TRUE(contains(bench.words(), "no time stamps")) << bench.words();
}

TEST(V4l2ImageSource, WhatCannotBeOpenedIsToldWithWhatToDoAndTriedForEver) {
  for (const auto& [error, words] : {std::pair{EACCES, "usermod -aG video"},
                                     {EBUSY, "used by another program"},
                                     {ENOTTY, "no video device"}}) {
    SourceBench bench;
    bench.card.open_error = error;
    bench.open();
    bench.run_for(seconds(30));
    EXPECT_TRUE(contains(bench.words(), words)) << bench.words();
    bench.card.open_error = 0;
    bench.run_for(seconds(3));
    EXPECT_EQ(bench.state(), DeviceState::kRunning);
  }
}

TEST(V4l2ImageSource, WhicheverCallFailsTheWordsNameItAndTheCardIsUsedOnceItWorks) {
  for (const unsigned long request : {VIDIOC_QUERYCAP, VIDIOC_S_FMT, VIDIOC_G_FMT, VIDIOC_REQBUFS,
                                      VIDIOC_QUERYBUF, VIDIOC_QBUF, VIDIOC_STREAMON, VIDIOC_DQBUF}) {
    SourceBench bench;
    bench.card.failing = {request};
    bench.open();
    bench.run_for(seconds(5));
    EXPECT_TRUE(contains(bench.words(), "failed: Input/output error")) << request << ": " << bench.words();
    EXPECT_TRUE(bench.frames.empty());
    bench.card.failing.clear();
    bench.run_for(seconds(3));
    EXPECT_EQ(bench.state(), DeviceState::kRunning) << request << ": " << bench.words();
  }
}

TEST(V4l2ImageSource, ADriverThatWakesForNothingDoesNotKeepTheThreadBusy) {
  SourceBench bench;
  bench.open();
  bench.run_for(seconds(1));
  bench.card.wakes_for_nothing = true;
  bench.card.hangs = true;
  bench.card.wakes = 0;

  bench.run_for(milliseconds(500));

  EXPECT_LE(bench.card.wakes, 10);
}

TEST(V4l2ImageSource, ADriverOfTheKernelThatMakesPicturesUpIsNoDevice) {
  for (const char* driver : {"vivid", "vimc", "v4l2 loopback"}) {
    SourceBench bench;
    bench.card.driver = driver;
    bench.open();
    bench.run_for(seconds(1));
    ASSERT_FALSE(bench.frames.empty());
    EXPECT_EQ(bench.frames.back().origin, Origin::kSimulated) << driver;
  }
}

TEST(V4l2ImageSource, APictureShownAgainIsNoSecondExposure) {
  SourceBench bench;
  bench.card.rate_hz = [](auto) { return 60.0; };
  bench.card.shows_each = 8;
  bench.settings.held_after = milliseconds(400);
  bench.open();

  bench.run_for(seconds(2));

  EXPECT_GE(bench.frames.size(), 14U);
  EXPECT_LE(bench.frames.size(), 16U) << "7.5 a second are new";
  for (const ImageFrame& frame : bench.frames) {
    ASSERT_TRUE(frame.fluoroscopy_on);
    ASSERT_LT(frame.received - frame.exposure, milliseconds(1)) << "decided at once";
  }
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  EXPECT_EQ(bench.words(), "");
}

TEST(V4l2ImageSource, AScreenThatHoldsItsLastImageIsFluoroscopyOff) {
  SourceBench bench;
  bench.settings.held_after = milliseconds(400);
  bench.open();
  bench.run_for(seconds(1));
  bench.card.shows_each = 1'000'000;
  bench.frames.clear();

  bench.run_for(seconds(2));

  ASSERT_FALSE(bench.frames.empty());
  EXPECT_TRUE(std::none_of(bench.frames.begin(), bench.frames.end(),
                           [](auto& frame) { return frame.fluoroscopy_on; }));
  EXPECT_GE(bench.frames.size(), 45U) << "after 400 ms one with every picture";
  EXPECT_LE(bench.frames.size(), 49U);
  EXPECT_EQ(bench.state(), DeviceState::kRunning);
  bench.card.shows_each = 1;
  bench.run_for(milliseconds(70));
  EXPECT_TRUE(bench.frames.back().fluoroscopy_on);
}

TEST(V4l2ImageSource, RowsWithPaddingAreDeliveredWithout) {
  SourceBench bench;
  bench.card.padding = 32;
  bench.open();

  bench.run_for(seconds(1));

  ASSERT_FALSE(bench.frames.empty());
  const auto& pixels = bench.frames.back().pixels;
  EXPECT_TRUE(std::all_of(pixels.begin(), pixels.begin() + 96 * 64, [&](auto p) { return p == pixels[0]; }));
}

}  // namespace
}  // namespace tubed
