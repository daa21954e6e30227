#include "drivers/replay/replay_driver.hpp"

#include <gtest/gtest.h>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/drivers/replay/small_sequence.hpp"

namespace tubed {
namespace {

constexpr MonotonicTime kLongAgo = from_ns(1'000'000'000);  // before every test: each row is due at once
constexpr MonotonicTime kNoWait{};

class ReplayDriver : public ::testing::Test {
 protected:
  ReplayDriver() {
    write_small_sequence(folder_);
    room_ = read_sequence(folder_.path()).room;
    frame_.reserve(5, 3);
  }

  [[nodiscard]] DriverSettings settings() const {
    std::map<std::string, SettingValue> values;
    for (const KeyDescription& setting : replay_settings()) {
      values[setting.name] = setting.default_value;
    }
    return DriverSettings(values)
        .with("folder", folder_.path().string())
        .with("start_monotonic_ns", to_ns(kLongAgo));
  }

  [[nodiscard]] std::unique_ptr<ImageSource> camera_a(const DriverSettings& with) const {
    return make_replay_image_source(room_, with, 0);
  }

  void expect_not_opened(ImageSource& source, const std::string& words) const {
    const OpenResult result = source.open();
    EXPECT_FALSE(result.ok);
    EXPECT_NE(result.why.find(words), std::string::npos) << result.why;
  }

  TemporaryFolder folder_;
  RoomDescription room_;
  ImageFrame frame_;
  EmFrame em_;
};

TEST_F(ReplayDriver, AnImageBringsTheGeometryOfItsRow) {
  folder_.write("geometry.csv", kSmallGeometry);
  const auto source = camera_a(settings());
  ASSERT_TRUE(source->open().ok);
  ASSERT_EQ(source->read(frame_), ReadOutcome::kFrame);
  ASSERT_TRUE(frame_.geometry);
  EXPECT_EQ(frame_.geometry->t_camera_world_mm[2], 1205);
}

TEST_F(ReplayDriver, AnImageWithoutARowOfGeometryBringsNone) {
  const auto source = camera_a(settings());
  ASSERT_TRUE(source->open().ok);
  frame_.geometry = ViewGeometry{};
  ASSERT_EQ(source->read(frame_), ReadOutcome::kFrame);
  EXPECT_FALSE(frame_.geometry);
}

TEST_F(ReplayDriver, ALateReaderGetsEveryMeasurementInOrder) {
  const auto source = make_replay_em_source(room_, settings());
  ASSERT_TRUE(source->open().ok);

  for (const std::uint32_t number : {7U, 8U, 9U}) {
    ASSERT_EQ(source->read(em_), ReadOutcome::kFrame);
    EXPECT_EQ(em_.tracker_frame, number);
    EXPECT_EQ(em_.measured, kLongAgo + std::chrono::milliseconds(25) * (number - 7));
  }
  EXPECT_EQ(source->read(em_), ReadOutcome::kEnded);
}

TEST_F(ReplayDriver, AMeasurementIsMarkedAsReplayedAndKeepsItsCoils) {
  const auto source = make_replay_em_source(room_, settings());
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(source->read(em_), ReadOutcome::kFrame);

  EXPECT_EQ(em_.origin, Origin::kReplayed);
  EXPECT_EQ(em_.coil_count, 2);
  EXPECT_EQ(em_.coils[0].p_em_mm, Eigen::Vector3d(1.5, -2, 3));
  EXPECT_EQ(em_.coils[1].status, CoilStatus::kMissing);
  EXPECT_GE(em_.received, em_.measured);
}

TEST_F(ReplayDriver, ALateReaderGetsTheNewestImageOnly) {
  const auto source = camera_a(settings());
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(source->read(frame_), ReadOutcome::kFrame);

  EXPECT_EQ(frame_.frame_number, 13U);
  EXPECT_EQ(frame_.exposure, kLongAgo + std::chrono::milliseconds(200));
  EXPECT_EQ(frame_.origin, Origin::kReplayed);
  EXPECT_TRUE(frame_.fluoroscopy_on);
  EXPECT_EQ(frame_.width, 4);
  EXPECT_EQ(frame_.pixels[11], 130 + 11);
  EXPECT_EQ(source->read(frame_), ReadOutcome::kEnded);
}

TEST_F(ReplayDriver, NothingIsDeliveredBeforeItsTime) {
  const MonotonicTime in_a_minute = monotonic_now() + std::chrono::minutes(1);
  const DriverSettings later = settings().with("start_monotonic_ns", to_ns(in_a_minute));
  const auto tracker = make_replay_em_source(room_, later);
  const auto camera = camera_a(later);
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_TRUE(camera->open().ok);

  EXPECT_EQ(tracker->read(em_), ReadOutcome::kNothing);
  EXPECT_EQ(camera->read(frame_), ReadOutcome::kNothing);
}

TEST_F(ReplayDriver, ARowIsWaitedForAndDeliveredOnTime) {
  const MonotonicTime soon = monotonic_now() + std::chrono::milliseconds(20);
  const auto source = camera_a(settings().with("start_monotonic_ns", to_ns(soon)));
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(read_until(*source, frame_, soon + std::chrono::seconds(10)), ReadOutcome::kFrame);

  EXPECT_GE(frame_.received, frame_.exposure);
  EXPECT_GE(frame_.exposure, soon);
}

TEST_F(ReplayDriver, AnInstantWithoutAFileIsWithoutFluoroscopy) {
  folder_.write("frames.csv", "frame,t_s,camera,file\n10,0,A,\n");
  std::filesystem::remove(folder_.path() / "truth.csv");
  const auto source = camera_a(settings());
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(source->read(frame_), ReadOutcome::kFrame);

  EXPECT_FALSE(frame_.fluoroscopy_on);
}

TEST_F(ReplayDriver, TwoCamerasOfOneInstantHaveOneExposureTimeAndOneStart) {
  const DriverSettings shared = settings().with("start_monotonic_ns", std::int64_t{0});
  const auto tracker = make_replay_em_source(room_, shared);
  const auto a = camera_a(shared);
  const auto b = make_replay_image_source(room_, shared, 1);
  const MonotonicTime before = monotonic_now();
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_TRUE(b->open().ok);
  ASSERT_TRUE(a->open().ok);
  ImageFrame of_b;
  of_b.reserve(5, 2);

  const MonotonicTime timeout = before + std::chrono::seconds(60);
  ASSERT_EQ(read_until(*a, frame_, timeout), ReadOutcome::kFrame);
  ASSERT_EQ(read_until(*b, of_b, timeout), ReadOutcome::kFrame);
  ASSERT_EQ(read_until(*tracker, em_, timeout), ReadOutcome::kFrame);

  EXPECT_EQ(of_b.frame_number, 11U);
  EXPECT_EQ((frame_.exposure - em_.measured) % std::chrono::milliseconds(100), std::chrono::nanoseconds(0));
  EXPECT_EQ(of_b.exposure, em_.measured);
  EXPECT_GE(em_.measured, before + std::chrono::milliseconds(300));
}

TEST_F(ReplayDriver, LoopingNumbersAndTimesGoOnGrowing) {
  // The lap: 0.2 s to the last exposure, plus the mean period of 0.1 s.
  const MonotonicTime start = monotonic_now() - std::chrono::milliseconds(1);
  const auto source =
      make_replay_em_source(room_, settings().with("loop", true).with("start_monotonic_ns", to_ns(start)));
  ASSERT_TRUE(source->open().ok);
  for (int row = 0; row < 3; ++row) {
    ASSERT_EQ(read_until(*source, em_, start + std::chrono::seconds(60)), ReadOutcome::kFrame);
  }

  ASSERT_EQ(read_until(*source, em_, start + std::chrono::seconds(60)), ReadOutcome::kFrame);

  EXPECT_EQ(em_.measured, start + std::chrono::milliseconds(300));
  EXPECT_EQ(em_.tracker_frame, 10U);
}

TEST_F(ReplayDriver, ACameraTheSequenceDoesNotHaveCannotBeOpened) {
  room_.cameras[0].name = "C";
  expect_not_opened(*camera_a(settings()), "has no camera 'C'");
}

TEST_F(ReplayDriver, ACameraOfAnotherSizeCannotBeOpened) {
  room_.cameras[0].width = 400;
  expect_not_opened(*camera_a(settings()), "is 4 x 3 pixels, the configured one 400 x 3 pixels");
}

TEST_F(ReplayDriver, ADamagedPictureIsFoundWhenOpening) {
  std::filesystem::remove(folder_.path() / "images/a10.png");
  expect_not_opened(*camera_a(settings()), "frames.csv:2:10");
}

TEST_F(ReplayDriver, ARecordingLargerThanTheMemoryGrantedCannotBeOpened) {
  folder_.replace("sequence.toml", "width = 4", "width = 1024");
  folder_.replace("sequence.toml", "height = 3", "height = 1024");
  write_image(folder_.path() / "images/a10.png", grey_image(1024, 1024, 0));
  room_ = read_sequence(folder_.path()).room;

  expect_not_opened(*camera_a(settings().with("memory_limit_mb", std::int64_t{1})), "memory_limit_mb = 1");
}

TEST_F(ReplayDriver, AFolderThatAppearsLaterCanBeOpenedThen) {
  const std::filesystem::path away = folder_.path().string() + "-away";
  const auto source = make_replay_em_source(room_, settings());
  std::filesystem::rename(folder_.path(), away);
  EXPECT_FALSE(source->open().ok);

  std::filesystem::rename(away, folder_.path());

  EXPECT_TRUE(source->open().ok);
}

TEST_F(ReplayDriver, OpenedAgainItGoesOnWhereItWas) {
  const auto source = make_replay_em_source(room_, settings());
  ASSERT_TRUE(source->open().ok);
  ASSERT_EQ(source->read(em_), ReadOutcome::kFrame);

  source->close();
  EXPECT_EQ(source->read(em_), ReadOutcome::kLost);
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(source->read(em_), ReadOutcome::kFrame);
  EXPECT_EQ(em_.tracker_frame, 8U);
}

TEST_F(ReplayDriver, ABufferTooSmallForTheImageIsRefused) {
  const auto source = camera_a(settings());
  ASSERT_TRUE(source->open().ok);
  ImageFrame small;
  small.reserve(1, 1);

  EXPECT_EQ(source->read(small), ReadOutcome::kRefused);
}

TEST_F(ReplayDriver, WaitingEndsWhenARowIsDueAndTakesNone) {
  const MonotonicTime soon = monotonic_now() + std::chrono::milliseconds(20);
  const auto source = make_replay_em_source(room_, settings().with("start_monotonic_ns", to_ns(soon)));
  ASSERT_TRUE(source->open().ok);
  source->wait(monotonic_now() + std::chrono::minutes(1));
  EXPECT_GE(monotonic_now(), soon);
  source->wait(monotonic_now() + std::chrono::minutes(1));
  ASSERT_EQ(source->read(em_), ReadOutcome::kFrame);
  EXPECT_EQ(em_.tracker_frame, 7U) << "the first row";
}

}  // namespace
}  // namespace tubed
