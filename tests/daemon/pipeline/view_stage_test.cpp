#include "daemon/pipeline/view_stage.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/pipeline/allocation_counter.hpp"
#include "tests/daemon/image/moving_background.hpp"
#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using namespace moving_background;

CameraCalibration view_of(int side) {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = camera.height = side;
  camera.fx = camera.fy = 1000;
  camera.T_camera_world.translation().z() = 1000 * kMmPerPx;
  return camera;
}

/// A fluoroscope in front of a stage that is stepped by hand.
class ViewStageTest : public ::testing::Test {
 protected:
  ViewStageTest() {
    frames_.for_each_slot([](ImageFrame& frame) { frame.reserve(kBackgroundSide, kBackgroundSide); });
  }

  /// As `camera` says, the world's x and y to the picture's right and down.
  static ViewGeometry panned(double right_mm) {
    CameraCalibration camera = view_of(kBackgroundSide);
    camera.T_camera_world.translation().x() = right_mm;
    return geometry_of(camera);
  }
  /// An exposure goes through; true when it came to a verdict.
  bool look(const Shot& shot) {
    inlet_.offer(fluoroscope_.take(shot));
    return stage_.step(clock_) && verdicts_.fetch();
  }
  /// Nine seconds of an unmoved patient.
  void learn() {
    for (int i = 0; i < 135; ++i) look({});
  }
  [[nodiscard]] StageReport report() const {
    StageReport report;
    stage_.describe(report);
    return report;
  }

  FakeClock clock_;
  Fluoroscope fluoroscope_;
  TripleBuffer<ImageFrame> frames_;
  TripleBuffer<ViewVerdict> verdicts_;
  Doorbell bell_;
  ViewInlet inlet_{&frames_, &bell_};
  TripleBuffer<ViewGeometry> configured_;
  ViewStage stage_{view_of(kBackgroundSide), frames_, verdicts_, bell_, &configured_};
};

TEST_F(ViewStageTest, SaysNothingBeforeTheFirstExposure) {
  EXPECT_FALSE(stage_.step(clock_));
  EXPECT_EQ(report().state, StageState::kStarting);
}

TEST_F(ViewStageTest, LearnsAndThenRunsWithoutAWord) {
  ASSERT_TRUE(look({}));
  EXPECT_EQ(verdicts_.front().state, ViewState::kUnjudged);
  EXPECT_EQ(report().state, StageState::kRunning);
  EXPECT_EQ(std::string(report().why.data()).find("learning the view"), 0U);
  learn();
  EXPECT_EQ(verdicts_.front().state, ViewState::kStill);
  EXPECT_STREQ(report().why.data(), "");
}

TEST_F(ViewStageTest, AMovedViewIsToldWithWhatToDo) {
  learn();
  ASSERT_TRUE(look({.pan_x_mm = 5}));
  EXPECT_EQ(verdicts_.front().state, ViewState::kSuspect);
  EXPECT_EQ(std::string(report().why.data()).find("the view may have moved"), 0U);
  for (int i = 0; i < 4; ++i) look({.pan_x_mm = 5});
  EXPECT_EQ(verdicts_.front().state, ViewState::kMoved);
  EXPECT_EQ(report().state, StageState::kDegraded);
  const std::string words = report().why.data();
  EXPECT_NE(words.find("went by about 5 mm"), std::string::npos) << words;
  EXPECT_NE(words.find("give the new T_camera_world"), std::string::npos) << words;
}

TEST_F(ViewStageTest, AMoveThatTheImagesAnnounceIsLearntAnew) {
  learn();
  for (int i = 0; i < 3; ++i) {
    ImageFrame frame = fluoroscope_.take({.pan_x_mm = -20});
    frame.geometry = panned(20);
    inlet_.offer(frame);
    ASSERT_TRUE(stage_.step(clock_) && verdicts_.fetch());
    EXPECT_EQ(verdicts_.front().state, ViewState::kUnjudged);
    EXPECT_EQ(verdicts_.front().why, UnjudgedView::kLearning);
  }
}

TEST_F(ViewStageTest, AMoveThatTheConfigurationAnnouncesIsLearntAnew) {
  learn();
  configured_.back() = panned(20);
  configured_.publish();
  ASSERT_TRUE(look({.pan_x_mm = -20}));
  EXPECT_EQ(verdicts_.front().state, ViewState::kUnjudged);
}

TEST_F(ViewStageTest, APoseThatStaysTheSameDoesNotHideAMove) {
  learn();
  ImageFrame frame = fluoroscope_.take({.pan_x_mm = -20});
  frame.geometry = panned(0.1);
  inlet_.offer(frame);
  ASSERT_TRUE(stage_.step(clock_) && verdicts_.fetch());
  EXPECT_EQ(verdicts_.front().state, ViewState::kSuspect);
}

TEST_F(ViewStageTest, AnImageWhoseGeometryIsRefusedIsNotLookedAt) {
  ImageFrame frame = fluoroscope_.take({});
  frame.geometry = panned(0);
  frame.geometry->fx = -1;
  inlet_.offer(frame);
  EXPECT_FALSE(stage_.step(clock_));
}

TEST_F(ViewStageTest, MovingBladesLeaveTheWordsAsTheyWere) {
  learn();
  for (int i = 0; i < 10; ++i) {
    look({.blade_px = 6 * i});
    EXPECT_STREQ(report().why.data(), "") << "image " << i;
  }
}

TEST_F(ViewStageTest, InstantsWithoutRadiationAndOtherSizesAreLeftOut) {
  ImageFrame off = fluoroscope_.take({});
  off.fluoroscopy_on = false;
  inlet_.offer(off);
  EXPECT_FALSE(stage_.step(clock_));
  ImageFrame narrow = fluoroscope_.take({});
  narrow.width = kBackgroundSide / 2;
  inlet_.offer(narrow);
  EXPECT_FALSE(stage_.step(clock_));
  ViewInlet{}.offer(fluoroscope_.take({}));
  EXPECT_TRUE(look({}));
}

// 12 bits in words of 16, of which nobody said how many are used.
TEST_F(ViewStageTest, ADetectorThatWasNotDescribedIsWatchedAsWell) {
  const auto look_wide = [this](const Shot& shot) {
    ImageFrame wide = fluoroscope_.take(shot);
    wide.depth = PixelDepth::kGrey16;
    std::vector<std::uint8_t> words(2 * wide.pixels.size());
    for (std::size_t i = 0; i < wide.pixels.size(); ++i) {
      words[2 * i] = static_cast<std::uint8_t>(wide.pixels[i] << 4U);
      words[2 * i + 1] = static_cast<std::uint8_t>(wide.pixels[i] >> 4U);
    }
    wide.pixels = words;
    inlet_.offer(wide);
    return stage_.step(clock_) && verdicts_.fetch();
  };
  for (int i = 0; i < 135; ++i) look_wide({});
  EXPECT_EQ(verdicts_.front().state, ViewState::kStill);
  ASSERT_TRUE(look_wide({.pan_x_mm = 5}));
  EXPECT_EQ(verdicts_.front().state, ViewState::kSuspect);
}

TEST_F(ViewStageTest, TheNewestExposureIsLookedAtAndTheOthersAreNot) {
  inlet_.offer(fluoroscope_.take({}));
  inlet_.offer(fluoroscope_.take({}));
  const ImageFrame& newest = fluoroscope_.take({});
  inlet_.offer(newest);
  ASSERT_TRUE(stage_.step(clock_) && verdicts_.fetch());
  EXPECT_EQ(verdicts_.front().exposure, newest.exposure);
  EXPECT_FALSE(stage_.step(clock_));
}

TEST_F(ViewStageTest, NeverAllocates) {
  learn();
  const ImageFrame& moved = fluoroscope_.take({.pan_x_mm = 5});
  const std::uint64_t before = costs_of_this_thread().allocations;
  for (int i = 0; i < 5; ++i) {
    inlet_.offer(moved);
    stage_.step(clock_);
  }
  EXPECT_EQ(costs_of_this_thread().allocations, before);
}

}  // namespace
}  // namespace tubed
