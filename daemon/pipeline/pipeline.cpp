#include "daemon/pipeline/pipeline.hpp"

#include <cmath>
#include <stdexcept>

#include "daemon/pipeline/frangi_stage.hpp"
#include "daemon/pipeline/image_grab_stage.hpp"
#include "daemon/pipeline/optimizer_stage.hpp"
#include "daemon/pipeline/preview_stage.hpp"
#include "daemon/pipeline/stage_thread.hpp"

namespace tubed {

namespace {

/// Mailboxes and doorbell of one camera.
struct CameraHandOver {
  TripleBuffer<ImageFrame> frames;
  TripleBuffer<MonotonicTime> announcements;
  TripleBuffer<ImageMeasurement> measurements;
  TripleBuffer<PredictedArea> predictions;
  TripleBuffer<ImageFrame> watched;
  TripleBuffer<ViewVerdict> views;
  // From the main thread, when the configuration changes it.
  TripleBuffer<ViewGeometry> configured;
  TripleBuffer<ViewGeometry> configured_for_watch;
  AreaPrediction prediction;  ///< of the optimizer's thread
  Doorbell frangi_bell;
  Doorbell view_bell;
  TripleBuffer<ImageFrame> previews;  ///< without memory unless somebody wants them

  /// `measured`: the camera of what is measured of its images.
  CameraHandOver(const CameraCalibration& camera, const CameraCalibration& measured,
                 const FrangiSettings& frangi)
      : prediction(measured, frangi) {
    predictions.for_each_slot(
        [&](PredictedArea& predicted) { predicted.area = ImageArea(measured.width, measured.height); });
    for (TripleBuffer<ImageFrame>* const mailbox : {&frames, &watched}) {
      mailbox->for_each_slot([&](ImageFrame& frame) { frame.reserve(camera.width, camera.height); });
    }
    measurements.for_each_slot(
        [&](ImageMeasurement& measurement) { measurement.reserve(measured.width, measured.height); });
  }

  void reserve_previews(const CameraCalibration& camera) {
    previews.for_each_slot([&](ImageFrame& frame) { frame.reserve(camera.width, camera.height); });
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
  Doorbell preview_bell;
  std::vector<std::unique_ptr<CameraHandOver>> cameras;
  std::vector<std::unique_ptr<TripleBuffer<TubeEstimate>>> estimates;
  std::vector<std::unique_ptr<Stage>> stages;
  std::vector<std::unique_ptr<StageThread>> threads;

  void add(std::string name, std::unique_ptr<Stage> stage, const ThreadSettings& thread) {
    threads.push_back(std::make_unique<StageThread>(std::move(name), *stage, thread));
    stages.push_back(std::move(stage));
  }

  /// Grab, watch and filter of the next camera; its hand-overs, as the optimizer sees them.
  CameraInlet add_camera(const CameraCalibration& camera, int binning, std::unique_ptr<ImageSource> source,
                         const FrangiSettings& frangi, bool has_previews) {
    const auto number = static_cast<int>(cameras.size());
    const CameraCalibration measured = binned(camera, binning);
    cameras.push_back(std::make_unique<CameraHandOver>(camera, measured, frangi));
    CameraHandOver& hand_over = *cameras.back();
    add("grab-" + camera.name,
        std::make_unique<ImageGrabStage>(
            std::move(source), settings, hand_over.frames, hand_over.announcements, hand_over.frangi_bell,
            ViewInlet{&hand_over.watched, &hand_over.view_bell},
            std::chrono::nanoseconds(std::llround(1e6 * camera.time_offset_ms)),
            camera.masks.empty() ? nullptr : std::make_unique<MaskCover>(camera)),
        settings.image_grab);
    add("view-" + camera.name,
        std::make_unique<ViewStage>(camera, hand_over.watched, hand_over.views, hand_over.view_bell,
                                    &hand_over.configured_for_watch),
        settings.view);
    auto frangi_stage = std::make_unique<FrangiStage>(
        number,
        ImageHalf{ImageDoor(camera, binning), VesselnessMeter(measured.width, measured.height, frangi)},
        hand_over.frames, hand_over.predictions, hand_over.measurements, hand_over.frangi_bell,
        optimizer_bell, &hand_over.configured);
    if (has_previews) {
      hand_over.reserve_previews(camera);
      frangi_stage->set_preview(PreviewTap(hand_over.previews, preview_bell));
    }
    add("frangi-" + camera.name, std::move(frangi_stage), settings.frangi);
    return {&hand_over.measurements, &hand_over.announcements, &hand_over.predictions, &hand_over.prediction,
            &hand_over.views};
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
                   const PipelineSettings& settings, Outlet& outlet, PreviewOutlet* previews)
    : parts_(std::make_unique<Parts>()) {
  if (!parts.em_source || parts.image_sources.size() != room.cameras.size() ||
      parts.estimators.size() != room.instruments.size()) {
    throw std::invalid_argument(
        "a pipeline needs an EM source, an image source a camera and an estimator an instrument");
  }
  Parts& p = *parts_;
  p.settings = settings;
  p.add("em",
        std::make_unique<EmAcquisitionStage>(std::move(parts.em_source), settings,
                                             EmHandOver{p.em_to_optimizer, p.optimizer_bell},
                                             EmHandOver{p.em_to_publisher, p.publisher_bell}, p.tracker),
        settings.em_acquisition);
  std::vector<CameraInlet> inlets;
  std::vector<TripleBuffer<ImageFrame>*> preview_mailboxes;
  for (std::size_t i = 0; i < room.cameras.size(); ++i) {
    inlets.push_back(p.add_camera(room.cameras[i], binning_of(room.cameras[i], room.instruments),
                                  std::move(parts.image_sources[i]), frangi, previews != nullptr));
    if (previews != nullptr) {
      preview_mailboxes.push_back(&p.cameras.back()->previews);
    }
  }
  if (previews != nullptr) {
    p.add("preview", std::make_unique<PreviewStage>(preview_mailboxes, *previews, p.preview_bell), {});
  }
  std::vector<TripleBuffer<TubeEstimate>*> outlets;
  for (std::size_t i = 0; i < parts.estimators.size(); ++i) {
    p.estimates.push_back(std::make_unique<TripleBuffer<TubeEstimate>>());
    outlets.push_back(p.estimates.back().get());
  }
  p.add("optimizer",
        std::make_unique<OptimizerStage>(std::move(parts.estimators), outlets, std::move(inlets),
                                         p.em_to_optimizer, settings, p.optimizer_bell, p.publisher_bell,
                                         room.reference),
        settings.optimizer);
  auto publisher =
      std::make_unique<PublisherStage>(outlets, p.em_to_publisher, p.tracker, outlet, p.publisher_bell);
  publisher->set_gather([&p](std::vector<NamedReport>& reports) {
    for (std::size_t i = 0; i < p.threads.size(); ++i) {
      reports.push_back({p.threads[i]->name(), &p.threads[i]->newest_report(), p.stages[i]->max_silence()});
    }
  });
  p.add("publisher", std::move(publisher), settings.publisher);
}

Pipeline::~Pipeline() = default;

void Pipeline::look_from(std::size_t camera, const ViewGeometry& configured) {
  CameraHandOver& hand_over = *parts_->cameras.at(camera);
  for (TripleBuffer<ViewGeometry>* const mailbox : {&hand_over.configured, &hand_over.configured_for_watch}) {
    mailbox->back() = configured;
    mailbox->publish();
  }
}

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
