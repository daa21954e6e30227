#include "daemon/pipeline/frangi_stage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr int kSize = 96;

/// A Frangi stage of one small camera, stepped by hand.
class FrangiBench {
 public:
  explicit FrangiBench(FrangiArea area = FrangiArea::kBand, double white_level = 0)
      : FrangiBench(area, ImageDoor(white_level)) {}

  FrangiBench(FrangiArea area, ImageDoor door) {
    FrangiSettings settings;
    settings.area = area;
    frames.for_each_slot([](ImageFrame& frame) { frame.reserve(kSize, kSize); });
    measurements.for_each_slot([](ImageMeasurement& m) { m.reserve(kSize, kSize); });
    predictions.for_each_slot([](PredictedArea& p) { p.area = ImageArea(kSize, kSize); });
    stage = std::make_unique<FrangiStage>(
        0, ImageHalf{std::move(door), VesselnessMeter(kSize, kSize, settings)}, frames, predictions,
        measurements, own_bell, optimizer_bell, &configured);
  }

  /// A noisy picture goes through the stage.
  const ImageMeasurement& show(unsigned seed) {
    std::vector<std::uint8_t> pixels(kSize * kSize);
    std::mt19937 random(seed);
    for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(100 + random() % 60);
    return show(pixels);
  }

  const ImageMeasurement& show(const std::vector<std::uint8_t>& pixels) {
    ImageFrame& frame = frames.back();
    frame.exposure = clock.now();
    frame.fluoroscopy_on = true;
    std::ranges::copy(pixels, frame.pixels.begin());
    frames.publish();
    EXPECT_TRUE(stage->step(clock));
    EXPECT_TRUE(measurements.fetch());
    return measurements.front();
  }

  void predict(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px, MonotonicTime until) {
    predictions.back().area.clear();
    predictions.back().area.add_box(low_px, high_px);
    predictions.back().until = until;
    predictions.publish();
  }

  FakeClock clock;
  TripleBuffer<ImageFrame> frames;
  TripleBuffer<PredictedArea> predictions;
  TripleBuffer<ImageMeasurement> measurements;
  TripleBuffer<ViewGeometry> configured;
  Doorbell own_bell;
  Doorbell optimizer_bell;
  std::unique_ptr<FrangiStage> stage;
};

TEST(FrangiStage, AChangedConfigurationIsTakenWithTheNextImage) {
  FrangiBench bench;
  EXPECT_FALSE(bench.show(1).geometry);
  ViewGeometry changed;
  changed.fx = 1234;
  bench.configured.back() = changed;
  bench.configured.publish();
  ASSERT_TRUE(bench.show(2).geometry);
  EXPECT_EQ(bench.measurements.front().geometry->fx, 1234);
}

TEST(FrangiStage, AGeometryThatCannotBeIsToldAndTheStageGoesOn) {
  FrangiBench bench;
  bench.frames.for_each_slot([](ImageFrame& f) { f.geometry = ViewGeometry{}; });
  EXPECT_EQ(bench.show(1).rejection, ImageRejection::kWrongGeometry);
  StageReport report;
  bench.stage->describe(report);
  EXPECT_EQ(report.state, StageState::kDegraded);
  EXPECT_EQ(std::string(report.why.data()),
            "image refused: the geometry that came with it cannot be: its focal lengths are not 1 to 1e6 px");
  bench.frames.for_each_slot([](ImageFrame& f) { f.geometry.reset(); });
  EXPECT_EQ(bench.show(2).state, ImageState::kMeasured);
}

TEST(FrangiStage, MeasuresTheWholeImageUntilTheOptimizerSaysWhereItReads) {
  FrangiBench bench;
  EXPECT_EQ(bench.show(1).measured.share(), 1);
  bench.predict({20, 20}, {40, 28}, bench.clock.now() + milliseconds(75));
  const ImageMeasurement& band = bench.show(2);
  EXPECT_TRUE(band.measured.covers_box({20, 20}, {40, 28}));
  EXPECT_FALSE(band.measured.covers_box({20, 20}, {40, 50}));
}

TEST(FrangiStage, APredictionServesUntilThereIsANewerOne) {
  FrangiBench bench;
  bench.predict({20, 20}, {40, 28}, bench.clock.now() + milliseconds(75));
  for (unsigned seed = 1; seed < 4; ++seed) {
    EXPECT_LT(bench.show(seed).measured.share(), 0.2);
  }
  bench.predict({60, 60}, {70, 70}, bench.clock.now() + milliseconds(75));
  EXPECT_FALSE(bench.show(4).measured.covers_box({20, 20}, {40, 28}));
}

TEST(FrangiStage, AfterTheTimeForeseenImagesAreMeasuredWhole) {
  FrangiBench bench;
  bench.predict({20, 20}, {40, 28}, bench.clock.now() + milliseconds(75));
  bench.clock.advance(milliseconds(75));
  EXPECT_LT(bench.show(1).measured.share(), 0.2);
  bench.clock.advance(milliseconds(1));
  EXPECT_EQ(bench.show(2).measured.share(), 1) << "the optimizer has stalled";
}

TEST(FrangiStage, SetToFramesItMeasuresThemWhateverIsPredicted) {
  FrangiBench bench(FrangiArea::kFrame);
  bench.predict({20, 20}, {40, 28}, bench.clock.now() + milliseconds(75));
  EXPECT_EQ(bench.show(1).measured.share(), 1);
}

TEST(FrangiStage, WhereNothingWillBeReadNothingIsMeasuredAndTheImageStillCounts) {
  FrangiBench bench;
  bench.predict({-20, -20}, {-10, -10}, bench.clock.now() + milliseconds(75));
  const ImageMeasurement& image = bench.show(1);
  EXPECT_TRUE(image.measured.empty());
  EXPECT_EQ(image.state, ImageState::kMeasured);
  EXPECT_GT(image.structureness[0], 0) << "whoever wants to see more can have it measured";
}

TEST(FrangiStage, ReadsTheNextImageForTheTubesThatWereFoundAndSaysSo) {
  FrangiBench bench;
  EXPECT_EQ(bench.show(1).polarity, RidgePolarity::kDark);
  StageReport report;
  bench.stage->describe(report);
  EXPECT_STREQ(report.why.data(), "");
  bench.predictions.back().polarity = RidgePolarity::kBright;
  bench.predict({20, 20}, {40, 28}, bench.clock.now() + milliseconds(75));
  EXPECT_EQ(bench.show(2).polarity, RidgePolarity::kBright);
  bench.predictions.back().polarity.reset();
  bench.predict({20, 20}, {40, 28}, bench.clock.now() + milliseconds(75));
  EXPECT_EQ(bench.show(3).polarity, RidgePolarity::kBright) << "it stays so";
  bench.stage->describe(report);
  EXPECT_STREQ(report.why.data(), "tubes are bright on its images: found from where the coils have the tube");
  EXPECT_EQ(report.state, StageState::kRunning);
}

TEST(FrangiStage, SaysThatTheConsoleAveragesItsImages) {
  CameraCalibration camera;
  camera.width = camera.height = kSize;
  FrangiBench bench(FrangiArea::kBand, ImageDoor(camera));
  std::mt19937 random(1);
  std::vector<double> shown(kSize * kSize, 128);
  std::vector<std::uint8_t> pixels(shown.size());
  StageReport report;
  for (int k = 0; k < 30; ++k) {
    for (std::size_t i = 0; i < shown.size(); ++i) {
      shown[i] += 0.5 * (static_cast<double>(100 + random() % 60) - shown[i]);
      pixels[i] = static_cast<std::uint8_t>(std::lround(shown[i]));
    }
    bench.show(pixels);
    bench.clock.advance(milliseconds(66));
    bench.stage->describe(report);
    if (k == 2) {
      EXPECT_STREQ(report.why.data(), "") << "nobody can know yet";
    }
  }
  const std::string words = report.why.data();
  EXPECT_EQ(words.find("its images are averaged over time, "), 0U) << words;
  EXPECT_NEAR(std::stod(words.substr(words.find(',') + 1)), 50, 4) << words;
  EXPECT_EQ(report.state, StageState::kRunning);
}

TEST(FrangiStage, ARefusedImageSaysWhy) {
  FrangiBench bench(FrangiArea::kBand, 150);
  EXPECT_EQ(bench.show(1).rejection, ImageRejection::kNone);
  FrangiBench brighter(FrangiArea::kBand, 110);
  EXPECT_EQ(brighter.show(1).rejection, ImageRejection::kSaturated) << "110 is this detector's white level";
  EXPECT_EQ(brighter.measurements.front().state, ImageState::kRejected);
  StageReport report;
  brighter.stage->describe(report);
  EXPECT_EQ(report.refused, 1U);
  EXPECT_NE(std::string(report.why.data()).find("saturated"), std::string::npos);
}

}  // namespace
}  // namespace tubed
