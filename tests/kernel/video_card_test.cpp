// The driver v4l2 at a video device of the kernel. Runs in the guest of video_guest.py: /dev/video0 shows
// what is written to /dev/video1.
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "drivers/simulation/simulation_driver.hpp"
#include "drivers/v4l2/linux_video_device.hpp"
#include "drivers/v4l2/v4l2_image_source.hpp"
#include "tests/kernel/vivid_device.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
constexpr const char* kCard = "/dev/video0";

/// What a console shows: radiographs of the simulation.
std::vector<std::vector<std::uint8_t>> radiographs(std::size_t count) {
  RoomDescription room;
  room.cameras.push_back(
      {.name = "A", .width = kWidth, .height = kHeight, .fx = 2000, .fy = 2000, .cx = 320, .cy = 240});
  room.cameras[0].T_camera_world.translation().z() = 1200;
  room.instruments.push_back({.id = "cath-1", .coils = {{.sensor = 1, .offset_from_tip_mm = 10}}});
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : simulation_settings()) {
    values.emplace(setting.name, setting.default_value);
  }
  const auto source = make_simulation_image_source(room, DriverSettings(values), 0);
  ImageFrame frame;
  frame.reserve(kWidth, kHeight);
  std::vector<std::vector<std::uint8_t>> all;
  EXPECT_TRUE(source->open().ok);
  while (all.size() < count) {
    if (read_until(*source, frame, monotonic_now() + seconds(10)) == ReadOutcome::kFrame) {
      all.emplace_back(frame.pixels.begin(), frame.pixels.begin() + kPixels);
    }
  }
  return all;
}

class VideoCard : public ::testing::Test {
 protected:
  VideoCard() {
    VividNode card(kCard);
    timings_ = card.number_of_timings(kWidth, kHeight);
    card.set("DV Timings Signal Mode", 0);
    card.set("OSD Text Mode", 2);
    card.set("Loop Video", 1);
    for (const char* change :
         {"Enable Capture Cropping", "Enable Capture Composing", "Enable Capture Scaler"}) {
      card.set(change, 0);  // it gives what its signal has, as most cards do
    }
    card.set("Percentage of Dropped Buffers", 0);
    card.set_timings(timings_);
    card.set_format(V4L2_BUF_TYPE_VIDEO_CAPTURE, V4L2_PIX_FMT_GREY, kWidth, kHeight);
    V4l2Settings settings;
    settings.request.path = kCard;
    settings.request.format = PixelFormat::kGrey;
    settings.request.size = {kWidth, kHeight};
    frame_.reserve(kWidth, kHeight);
    source_ =
        std::make_unique<V4l2ImageSource>(CameraCalibration{.name = "A", .width = kWidth, .height = kHeight},
                                          settings, std::make_unique<LinuxVideoDevice>());
  }
  ReadOutcome read_for(std::chrono::nanoseconds time) {
    return read_until(*source_, frame_, monotonic_now() + time);
  }
  [[nodiscard]] std::vector<std::uint8_t> pixels() const {
    return {frame_.pixels.begin(), frame_.pixels.begin() + kPixels};
  }
  /// Reads until the words contain `text`; how long that took.
  std::chrono::nanoseconds time_until_said(const std::string& text,
                                           std::chrono::nanoseconds longest = seconds(20)) {
    const MonotonicTime from = monotonic_now();
    while (monotonic_now() < from + longest) {
      read_for(milliseconds(5));
      if (source_->condition().words.text().find(text) != std::string_view::npos) {
        return monotonic_now() - from;
      }
    }
    ADD_FAILURE() << "never said: " << text << "; it says: " << source_->condition().words.text();
    return longest;
  }
  bool delivers_within(std::chrono::nanoseconds longest) {
    const MonotonicTime until = monotonic_now() + longest;
    while (monotonic_now() < until) {
      if (read_for(milliseconds(100)) == ReadOutcome::kFrame) {
        return true;
      }
    }
    ADD_FAILURE() << "no picture; it says: " << source_->condition().words.text();
    return false;
  }

  int timings_ = 0;
  ImageFrame frame_;
  std::unique_ptr<V4l2ImageSource> source_;
};

TEST_F(VideoCard, WhatAConsoleShowsIsDeliveredBitForBit) {
  const auto shown = radiographs(4);
  VividConsole console(timings_, kWidth, kHeight);
  std::size_t compared = 0;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    console.show(shown[k]);
    bool has_come = false;
    for (int picture = 0; picture < 60 && !has_come; ++picture) {
      ASSERT_TRUE(delivers_within(seconds(20)));
      has_come = pixels() == shown[k];
      const bool is_one_of_them = has_come || k == 0 || pixels() == shown[k - 1];
      ASSERT_TRUE(is_one_of_them) << "a picture that nobody has shown";
      compared += is_one_of_them && k > 0 ? 1 : 0;
      EXPECT_EQ(frame_.origin, Origin::kSimulated) << "no real device";
      EXPECT_LT(frame_.exposure, frame_.received);
      EXPECT_LT(frame_.received - frame_.exposure, seconds(2));
    }
    ASSERT_TRUE(has_come) << "picture " << k << " has not come; " << source_->condition().words.text();
  }
  std::cout << shown.size() << " radiographs, " << compared << " pictures compared, "
            << source_->counts().overtaken << " overtaken, " << source_->counts().lost << " lost\n";
}

TEST_F(VideoCard, ASecondProgramIsToldThatTheCardIsUsed) {
  ASSERT_TRUE(delivers_within(seconds(20)));
  V4l2Settings settings;
  settings.request.path = kCard;
  V4l2ImageSource second({.name = "A", .width = kWidth, .height = kHeight}, settings,
                         std::make_unique<LinuxVideoDevice>());
  ImageFrame frame;
  frame.reserve(kWidth, kHeight);
  read_until(second, frame, monotonic_now() + milliseconds(200));

  EXPECT_NE(second.condition().words.text().find("used by another program"), std::string_view::npos)
      << second.condition().words.text();
}

TEST_F(VideoCard, ACardThatIsPulledOutIsToldAndUsedAgainWhenItIsBack) {
  ASSERT_TRUE(delivers_within(seconds(20)));
  auto console = std::make_unique<VividNode>("/dev/video1");  // the device stays away while this is open
  VividNode(kCard).set("Disconnect", 1);

  time_until_said("has gone");
  EXPECT_EQ(source_->condition().state, DeviceState::kReconnecting);
  EXPECT_EQ(read_for(milliseconds(500)), ReadOutcome::kNothing);
  console.reset();
  EXPECT_TRUE(delivers_within(seconds(20)));
  EXPECT_EQ(source_->condition().state, DeviceState::kRunning);
}

TEST_F(VideoCard, ALostSignalIsToldAndUsedAgainWhenItIsBack) {
  ASSERT_TRUE(delivers_within(seconds(20)));
  VividNode node(kCard);
  node.set("DV Timings Signal Mode", 1);  // no signal

  time_until_said("no signal");
  EXPECT_EQ(read_for(milliseconds(500)), ReadOutcome::kNothing);
  node.set("DV Timings Signal Mode", 0);
  EXPECT_TRUE(delivers_within(seconds(20)));
}

TEST_F(VideoCard, AnotherResolutionIsToldWithBothSizesAndTheRightOneIsUsedAgain) {
  ASSERT_TRUE(delivers_within(seconds(20)));
  VividNode node(kCard);
  node.set_choice("DV Timings", "800x600");
  node.set("DV Timings Signal Mode", 4);  // the selected timings
  node.set("Colorspace", 1);              // whereupon the device says that its source has changed

  time_until_said("800 x 600");
  EXPECT_EQ(read_for(milliseconds(500)), ReadOutcome::kNothing);
  node.set_choice("DV Timings", "640x480");
  EXPECT_TRUE(delivers_within(seconds(20)));
}

TEST_F(VideoCard, ADriverThatHangsIsToldAndStartedAnew) {
  ASSERT_TRUE(delivers_within(seconds(20)));
  VividNode node(kCard);
  node.set("Percentage of Dropped Buffers", 100);

  time_until_said("its driver hangs");
  EXPECT_EQ(source_->condition().state, DeviceState::kReconnecting);
  node.set("Percentage of Dropped Buffers", 0);
  EXPECT_TRUE(delivers_within(seconds(20)));
}

TEST_F(VideoCard, EveryFormatOfTheDeviceIsRead) {
  source_->close();
  for (const PixelFormat format :
       {PixelFormat::kGrey, PixelFormat::kY10, PixelFormat::kY12, PixelFormat::kY16, PixelFormat::kYuyv,
        PixelFormat::kUyvy, PixelFormat::kNv12, PixelFormat::kRgb24, PixelFormat::kBgr24}) {
    V4l2Settings settings;
    settings.request.path = kCard;
    settings.request.format = format;
    settings.request.size = {kWidth, kHeight};
    V4l2ImageSource source({.name = "A", .width = kWidth, .height = kHeight}, settings,
                           std::make_unique<LinuxVideoDevice>());
    ReadOutcome outcome = ReadOutcome::kNothing;
    for (int attempt = 0; attempt < 40 && outcome != ReadOutcome::kFrame; ++attempt) {
      outcome = read_until(source, frame_, monotonic_now() + milliseconds(500));
    }
    EXPECT_EQ(outcome, ReadOutcome::kFrame)
        << facts_of(format).word << ": " << source.condition().words.text();
  }
}

TEST(VideoCardThatIsNone, IsToldByItsKind) {
  std::ofstream("/tmp/file") << "no device";
  const std::map<std::string, std::string> words{{"/dev/video9", "is not there"},
                                                 {"/tmp/file", "is no video device"},
                                                 {"/dev/null", "is no video device"},
                                                 {"/dev/video1", "captures no video"}};
  for (const auto& [path, text] : words) {
    CardStream stream(std::make_unique<LinuxVideoDevice>(),
                      {.path = path, .input = {}, .format = {}, .size = {}});
    EXPECT_FALSE(stream.start());
    EXPECT_NE(stream.trouble().text().find(text), std::string_view::npos) << stream.trouble().text();
  }
}

}  // namespace
}  // namespace tubed
