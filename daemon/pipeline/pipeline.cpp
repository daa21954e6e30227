#include "daemon/pipeline/pipeline.hpp"

#include <stdexcept>

#include "daemon/pipeline/frangi_stage.hpp"
#include "daemon/pipeline/image_grab_stage.hpp"
#include "daemon/pipeline/optimizer_stage.hpp"
#include "daemon/pipeline/stage_thread.hpp"

namespace tubed {

namespace {

/// Mailboxes and doorbell of one camera.
struct CameraHandOver {
  TripleBuffer<ImageFrame> frames;
  TripleBuffer<MonotonicTime> announcements;
  TripleBuffer<ImageMeasurement> measurements;
  TripleBuffer<PredictedArea> predictions;
  AreaPrediction prediction;  ///< of the optimizer's thread
  Doorbell frangi_bell;

  CameraHandOver(const CameraCalibration& camera, const FrangiSettings& frangi) : prediction(camera, frangi) {
    predictions.for_each_slot(
        [&](PredictedArea& predicted) { predicted.area = ImageArea(camera.width, camera.height); });
    frames.for_each_slot([&](ImageFrame& frame) { frame.reserve(camera.width, camera.height); });
    measurements.for_each_slot(
        [&](ImageMeasurement& measurement) { measurement.reserve(camera.width, camera.height); });
  }
};

}  // namespace

struct Pipeline::Parts {
  PipelineSettings settings;
  // Declared first, destroyed last: what threads reach must outlive them.
  EmRing em_to_optimizer;
  EmRing em_to_publisher;
  TripleBuffer<TrackerIdentity> tracker;
  Doorbell optimizer_bell;
  Doorbell publisher_bell;
  std::vector<std::unique_ptr<CameraHandOver>> cameras;
  std::vector<std::unique_ptr<TripleBuffer<TubeEstimate>>> estimates;
  std::vector<std::unique_ptr<Stage>> stages;
  std::vector<std::unique_ptr<StageThread>> threads;

  void add(std::string name, std::unique_ptr<Stage> stage, const ThreadSettings& thread) {
    threads.push_back(std::make_unique<StageThread>(std::move(name), *stage, thread));
    stages.push_back(std::move(stage));
  }

  ~Parts() {
    for (const auto& thread : threads) {
      thread->request_stop();
    }
    // All of them before any is destroyed: the publisher reads the reports of the others to the last.
    for (const auto& thread : threads) {
      thread->join();
    }
  }
};

Pipeline::Pipeline(PipelineParts parts, const RoomDescription& room, const FrangiSettings& frangi,
                   const PipelineSettings& settings, Outlet& outlet)
    : parts_(std::make_unique<Parts>()) {
  if (!parts.em_source || parts.image_sources.size() != room.cameras.size() ||
      parts.estimators.size() != room.instruments.size()) {
    throw std::invalid_argument(
        "a pipeline needs an EM source, an image source a camera and an estimator an instrument");
  }
  Parts& p = *parts_;
  p.settings = settings;
  p.add("em",
        std::make_unique<EmAcquisitionStage>(std::move(parts.em_source), settings, p.em_to_optimizer,
                                             p.em_to_publisher, p.tracker, p.publisher_bell),
        settings.em_acquisition);
  std::vector<CameraInlet> inlets;
  for (std::size_t i = 0; i < room.cameras.size(); ++i) {
    const CameraCalibration& camera = room.cameras[i];
    p.cameras.push_back(std::make_unique<CameraHandOver>(camera, frangi));
    CameraHandOver& hand_over = *p.cameras.back();
    p.add("grab-" + camera.name,
          std::make_unique<ImageGrabStage>(std::move(parts.image_sources[i]), settings, hand_over.frames,
                                           hand_over.announcements, hand_over.frangi_bell),
          settings.image_grab);
    p.add("frangi-" + camera.name,
          std::make_unique<FrangiStage>(
              static_cast<int>(i),
              ImageHalf{ImageDoor(camera.white_level), VesselnessMeter(camera.width, camera.height, frangi)},
              hand_over.frames, hand_over.predictions, hand_over.measurements, hand_over.frangi_bell,
              p.optimizer_bell),
          settings.frangi);
    inlets.push_back(
        {&hand_over.measurements, &hand_over.announcements, &hand_over.predictions, &hand_over.prediction});
  }
  std::vector<TripleBuffer<TubeEstimate>*> outlets;
  for (std::size_t i = 0; i < parts.estimators.size(); ++i) {
    p.estimates.push_back(std::make_unique<TripleBuffer<TubeEstimate>>());
    outlets.push_back(p.estimates.back().get());
  }
  p.add("optimizer",
        std::make_unique<OptimizerStage>(std::move(parts.estimators), outlets, std::move(inlets),
                                         p.em_to_optimizer, settings, p.optimizer_bell, p.publisher_bell),
        settings.optimizer);
  auto publisher =
      std::make_unique<PublisherStage>(outlets, p.em_to_publisher, p.tracker, outlet, p.publisher_bell);
  publisher->set_gather([&threads = p.threads](std::vector<NamedReport>& reports) {
    for (const auto& thread : threads) {
      reports.push_back({thread->name(), &thread->newest_report()});
    }
  });
  p.add("publisher", std::move(publisher), settings.publisher);
}

Pipeline::~Pipeline() = default;

std::vector<std::string> Pipeline::start() {
  std::vector<std::string> refusals;
  // Consumers first, so that nothing is superseded while the rest starts.
  for (auto thread = parts_->threads.rbegin(); thread != parts_->threads.rend(); ++thread) {
    const SchedulingOutcome outcome = (*thread)->start();
    if (outcome.refused) {
      if (!parts_->settings.scheduling_optional) {
        throw std::runtime_error(outcome.why);
      }
      refusals.push_back(outcome.why);
    }
  }
  return refusals;
}

}  // namespace tubed
