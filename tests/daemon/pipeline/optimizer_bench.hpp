// The optimizer's stage between sources and outlets that a test fills and reads by hand.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/pipeline/optimizer_stage.hpp"
#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {

/// An optimizer with two cameras and `instruments` instruments, stepped by hand.
class OptimizerBench {
 public:
  explicit OptimizerBench(int instruments = 1)
      : asked(static_cast<std::size_t>(instruments)), estimates(static_cast<std::size_t>(instruments)) {
    std::vector<std::unique_ptr<Estimator>> estimators;
    std::vector<TripleBuffer<TubeEstimate>*> outlets;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      auto estimator = std::make_unique<FakeEstimator>(asked[i]);
      fakes.push_back(estimator.get());
      estimators.push_back(std::move(estimator));
      outlets.push_back(&estimates[i]);
    }
    std::vector<CameraInlet> inlets;
    for (auto& camera : cameras) {
      inlets.push_back({&camera.measurements, &camera.announcements, nullptr, nullptr, &camera.views});
    }
    stage = std::make_unique<OptimizerStage>(std::move(estimators), outlets, inlets, em, PipelineSettings{},
                                             bell, publisher_bell);
    stage->step(clock);  // the tick of the start
    for (auto& buffer : estimates) {
      buffer.fetch();
    }
    for (auto& list : asked) {
      list.clear();
    }
  }

  void announce(int camera, MonotonicTime exposure) {
    cameras[static_cast<std::size_t>(camera)].announcements.back() = exposure;
    cameras[static_cast<std::size_t>(camera)].announcements.publish();
  }

  void measure(int camera, MonotonicTime exposure, ImageState state = ImageState::kMeasured) {
    auto& buffer = cameras[static_cast<std::size_t>(camera)].measurements;
    buffer.back().exposure = exposure;
    buffer.back().frangi_finished = clock.now();
    buffer.back().state = state;
    buffer.publish();
  }

  void judge_view(int camera, ViewState state) {
    auto& buffer = cameras[static_cast<std::size_t>(camera)].views;
    buffer.back().state = state;
    buffer.publish();
  }

  struct CameraHandOver {
    TripleBuffer<ImageMeasurement> measurements;
    TripleBuffer<MonotonicTime> announcements;
    TripleBuffer<ViewVerdict> views;
  };
  /// What the stage says of itself after the next tick.
  std::string why_after_a_tick() {
    clock.advance(std::chrono::milliseconds(50));
    stage->step(clock);
    StageReport report;
    stage->describe(report);
    return report.why.data();
  }

  FakeClock clock;
  std::vector<std::vector<Observation>> asked;
  std::vector<FakeEstimator*> fakes;  ///< the stage's
  std::vector<TripleBuffer<TubeEstimate>> estimates;
  std::array<CameraHandOver, 2> cameras;
  EmRing em;
  Doorbell bell;
  Doorbell publisher_bell;
  std::unique_ptr<OptimizerStage> stage;
};

}  // namespace tubed
