#include "daemon/pipeline/pipeline.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

/// Sleeps to a beat; the common half of both sources.
class Beat {
 public:
  explicit Beat(milliseconds period) : period_(period), next_(steady_clock::now() + period) {}
  void wait(MonotonicTime deadline) const {
    std::this_thread::sleep_until(std::min<MonotonicTime>(deadline, next_));
  }
  bool take() {
    if (steady_clock::now() < next_) {
      return false;
    }
    next_ += period_;
    return true;
  }

 private:
  milliseconds period_;
  MonotonicTime next_;
};

class BeatingEmSource final : public EmSource {
 public:
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime deadline) noexcept override { beat_.wait(deadline); }
  ReadOutcome read(EmFrame& frame) noexcept override {
    if (!beat_.take()) {
      return ReadOutcome::kNothing;
    }
    frame.measured = frame.received = steady_clock::now();
    frame.tracker_frame = ++number_;
    return ReadOutcome::kFrame;
  }
  void close() noexcept override {}

 private:
  Beat beat_{milliseconds(25)};
  std::uint32_t number_ = 0;
};

class BeatingImageSource final : public ImageSource {
 public:
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime deadline) noexcept override { beat_.wait(deadline); }
  ReadOutcome read(ImageFrame& frame) noexcept override {
    if (!beat_.take()) {
      return ReadOutcome::kNothing;
    }
    frame.exposure = frame.received = steady_clock::now();
    frame.frame_number = ++number_;
    frame.fluoroscopy_on = true;
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
      frame.pixels[i] = static_cast<std::uint8_t>(i * 31 + number_ * 7);
    }
    return ReadOutcome::kFrame;
  }
  void close() noexcept override {}

 private:
  Beat beat_{milliseconds(33)};
  std::uint32_t number_ = 0;
};

RoomDescription two_small_views() {
  RoomDescription room;
  for (const char* name : {"A", "B"}) {
    CameraCalibration camera;
    camera.name = name;
    camera.width = camera.height = 64;
    camera.fx = camera.fy = 100;
    room.cameras.push_back(camera);
  }
  room.instruments = {InstrumentDescription{.id = "cath-1", .coils = {CoilPlacement{}}},
                      InstrumentDescription{.id = "cath-2", .coils = {CoilPlacement{}}}};
  return room;
}

/// Two views, two instruments, real threads, nothing but the sources and the estimators made up.
struct RunningPipeline {
  explicit RunningPipeline(PipelineSettings settings = {}) {
    PipelineParts parts;
    parts.em_source = std::make_unique<BeatingEmSource>();
    for (int camera = 0; camera < 2; ++camera) {
      parts.image_sources.push_back(std::make_unique<BeatingImageSource>());
    }
    for (auto& list : asked) {
      parts.estimators.push_back(std::make_unique<FakeEstimator>(list));
    }
    pipeline =
        std::make_unique<Pipeline>(std::move(parts), two_small_views(), FrangiSettings{}, settings, outlet);
  }
  std::array<std::vector<Observation>, 2> asked;
  FakeOutlet outlet;  // of the publisher's thread until the pipeline is gone
  std::unique_ptr<Pipeline> pipeline;
};

TEST(Pipeline, CarriesMeasurementsOfAllSourcesToTheOutlet) {
  RunningPipeline running;
  running.pipeline->start();
  std::this_thread::sleep_for(milliseconds(1500));
  running.pipeline.reset();
  EXPECT_GT(running.outlet.em_frames.size(), 20U);
  EXPECT_GT(running.outlet.estimates.size(), 30U);
  for (std::size_t i = 1; i < running.outlet.em_frames.size(); ++i) {
    ASSERT_EQ(running.outlet.em_frames[i], running.outlet.em_frames[i - 1] + 1) << "none lost, in order";
  }
  int with_images = 0;
  for (const Observation& observation : running.asked[0]) {
    with_images += observation.is_image_instant ? 1 : 0;
  }
  EXPECT_GT(with_images, 10);
  EXPECT_EQ(running.outlet.stage_count, 9U) << "em, two grabs, two Frangis, two views, optimizer, publisher";
}

TEST(Pipeline, EndsQuicklyAndCanBeMadeAgain) {
  for (int round = 0; round < 3; ++round) {
    RunningPipeline running;
    running.pipeline->start();
    const auto before = steady_clock::now();
    running.pipeline.reset();
    EXPECT_LT(steady_clock::now() - before, std::chrono::seconds(2));
  }
}

TEST(Pipeline, RefusedSchedulingThatIsRequiredIsAStartUpError) {
  PipelineSettings settings;
  settings.scheduling_optional = false;
  settings.frangi.cpus = {1000};
  RunningPipeline running(settings);
  EXPECT_THROW(running.pipeline->start(), std::runtime_error);
}

TEST(Pipeline, RefusedSchedulingThatIsOptionalIsReported) {
  PipelineSettings settings;
  settings.frangi.cpus = {1000};
  RunningPipeline running(settings);
  EXPECT_EQ(running.pipeline->start().size(), 2U) << "both Frangi threads";
}

TEST(Pipeline, PartsThatDoNotFitTheRoomAreRefused) {
  FakeOutlet outlet;
  EXPECT_THROW(Pipeline(PipelineParts{}, two_small_views(), FrangiSettings{}, PipelineSettings{}, outlet),
               std::invalid_argument);
}

}  // namespace
}  // namespace tubed
