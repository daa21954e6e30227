#include "clients/evaluation/offline_reconstruction.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "daemon/estimator/images/area_prediction.hpp"
#include "daemon/estimator/images/image_timeout.hpp"
#include "daemon/image/image_checks.hpp"
#include "daemon/image/mask_cover.hpp"
#include "daemon/image/view_follower.hpp"
#include "drivers/replay/sequence_image.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kStart_ns = 1'000'000'000;

/// The image half of one camera.
struct CameraBench {
  MaskCover cover;
  ImageDoor door;
  VesselnessMeter meter;
  ImageMeasurement measurement;
  AreaPrediction prediction;
  ViewFollower watch;
  ViewGeometry configured;
  bool has_moved = false;  ///< the view is not, or may not be, where its pose says
  PredictedArea predicted;
  ImageArea whole;

  /// `measured`: the camera of what is measured of its images.
  CameraBench(const CameraCalibration& camera, int binning, const CameraCalibration& measured,
              const FrangiSettings& frangi)
      : cover(camera),
        door(camera, binning),
        meter(measured.width, measured.height, frangi),
        prediction(measured, frangi),
        watch(camera),
        configured(geometry_of(camera)) {
    measurement.reserve(measured.width, measured.height);
    whole = measurement.measured;
  }

  void measure(const Sequence& sequence, const SequenceFrame& row) {
    measurement.camera = row.camera;
    measurement.origin = Origin::kReplayed;
    measurement.frame_number = row.frame;
    measurement.exposure = sequence_time(row.t_s);
    measurement.state = ImageState::kOff;
    measurement.rejection = ImageRejection::kNone;
    if (!row.fluoroscopy_on()) {
      return;
    }
    ImageFrame frame = image_frame_of(sequence, row);
    cover.cover(frame);
    measurement.rejection = door.take(frame, measurement);
    measurement.state =
        measurement.rejection == ImageRejection::kNone ? ImageState::kMeasured : ImageState::kRejected;
    if (measurement.state == ImageState::kMeasured) {
      watch.look_from(measurement.geometry ? *frame.geometry : configured, measurement.exposure);
      const ViewState view = watch.observe(frame).state;
      has_moved = view == ViewState::kSuspect || view == ViewState::kMoved;
      if (predicted.polarity) meter.read_as(*predicted.polarity);
      meter.take(measurement, measurement.exposure <= predicted.until ? predicted.area : whole);
    }
  }
};

EmFrame em_frame_of(const SequenceMeasurement& measurement) {
  EmFrame frame;
  frame.measured = frame.received = sequence_time(measurement.t_s);
  frame.tracker_frame = measurement.em_frame;
  frame.origin = Origin::kReplayed;
  frame.coil_count = measurement.coil_count;
  frame.coils = measurement.coils;
  return frame;
}

/// Tells the cameras of a run where their next images will be read.
class NextImages final : public AreaPredictions {
 public:
  explicit NextImages(std::vector<std::unique_ptr<CameraBench>>& benches) : benches_(benches) {}

  void begin(const Observation& observation) {
    for (const auto& bench : benches_) {
      bench->prediction.begin(observation.instant, observation.image_timeout);
    }
  }
  void add(const Estimator& estimator, const TubeEstimate& estimate) override {
    for (std::size_t v = 0; v < benches_.size(); ++v) {
      benches_[v]->prediction.add(estimator.image_need(), estimate);
      benches_[v]->prediction.read_as(estimator.polarity_of(v));
    }
  }
  void end() {
    for (const auto& bench : benches_) {
      bench->predicted = bench->prediction.end();
    }
  }

 private:
  std::vector<std::unique_ptr<CameraBench>>& benches_;
};

}  // namespace

MonotonicTime sequence_time(double t_s) { return from_ns(kStart_ns + std::llround(t_s * 1e9)); }

ImageFrame image_frame_of(const Sequence& sequence, const SequenceFrame& row) {
  GreyImage image = read_image(sequence, row);
  ImageFrame frame;
  frame.exposure = sequence_time(row.t_s);
  frame.width = image.width;
  frame.height = image.height;
  frame.depth = image.depth;
  frame.geometry = row.geometry;
  frame.fluoroscopy_on = true;
  frame.pixels = std::move(image.pixels);
  return frame;
}

std::vector<SequenceInstant> instants_of(const Sequence& sequence) {
  std::vector<SequenceInstant> instants;
  for (std::size_t row = 0; row < sequence.frames.size(); ++row) {
    const SequenceFrame& frame = sequence.frames[row];
    if (instants.empty() || instants.back().t_s != frame.t_s) {
      instants.push_back({frame.frame, frame.t_s, {}});
    }
    instants.back().frame = frame.frame;
    instants.back().rows.push_back(row);
  }
  return instants;
}

void observe_in_turn(const Sequence& sequence, Images images, const FrangiSettings& frangi,
                     const OnObservation& on_observation, std::chrono::nanoseconds max_image_timeout) {
  std::vector<std::unique_ptr<CameraBench>> benches;
  for (const CameraCalibration& camera : sequence.room.cameras) {
    const int binning = binning_of(camera, sequence.room.instruments);
    benches.push_back(std::make_unique<CameraBench>(camera, binning, binned(camera, binning), frangi));
  }
  NextImages next_images(benches);
  const auto history = std::make_unique<EmHistory>(sequence.room.reference);
  auto next_em = sequence.measurements.begin();
  MonotonicTime newest_image{};
  MonotonicTime newest_left_out{};
  ImageTimeout timeout;
  for (const SequenceInstant& instant : instants_of(sequence)) {
    for (; next_em != sequence.measurements.end() && next_em->t_s <= instant.t_s; ++next_em) {
      history->add(em_frame_of(*next_em));
    }
    Observation observation;
    observation.instant = observation.now = sequence_time(instant.t_s);
    observation.is_image_instant = true;
    observation.em = history.get();
    for (const std::size_t row : instant.rows) {
      const SequenceFrame& frame = sequence.frames[row];
      CameraBench& bench = *benches[static_cast<std::size_t>(frame.camera)];
      if (images == Images::kMeasured) {
        bench.measure(sequence, frame);
        if (bench.measurement.state == ImageState::kMeasured) {
          bench.prediction.look_from(bench.measurement.geometry);
        }
        bench.prediction.on_demand().begin();
        const auto camera = static_cast<std::size_t>(frame.camera);
        if (!bench.has_moved) {
          observation.images[camera] = &bench.measurement;
          observation.on_demand[camera] = &bench.prediction.on_demand();
        } else if (bench.measurement.state == ImageState::kMeasured) {
          const ViewVerdict& verdict = bench.watch.newest();
          observation.moved[camera] = {&bench.measurement,  &bench.prediction.on_demand(), verdict.moves,
                                       verdict.has_settled, verdict.is_suspect_here,       verdict.motion};
        }
        observation.fluoroscopy_off = bench.measurement.state == ImageState::kOff;
        observation.image_rejected = bench.measurement.state == ImageState::kRejected;
        if (bench.measurement.state == ImageState::kMeasured) {
          (bench.has_moved ? newest_left_out : newest_image) = observation.instant;
        }
      }
    }
    observation.geometry_changed =
        std::ranges::any_of(benches, [](const auto& bench) { return bench->has_moved; });
    observation.newest_image = newest_image;
    observation.newest_left_out = newest_left_out;
    timeout.saw_instant(observation.instant);
    observation.image_timeout = timeout.timeout(max_image_timeout);
    next_images.begin(observation);
    if (!on_observation(instant, observation, next_images)) {
      return;
    }
    next_images.end();
  }
}

void reconstruct(const Sequence& sequence, const EstimatorSettings& settings, const FrangiSettings& frangi,
                 const OnEstimate& on_estimate, std::chrono::nanoseconds max_image_timeout) {
  const auto estimator = make_estimator(settings, sequence.room.instruments.front(), sequence.room);
  const auto estimate = std::make_unique<TubeEstimate>();
  const Images images = settings.mode == EstimatorMode::kEm ? Images::kLeftOut : Images::kMeasured;
  observe_in_turn(
      sequence, images, frangi,
      [&](const SequenceInstant& instant, const Observation& observation, AreaPredictions& next) {
        estimate->sequence_number += 1;
        estimator->estimate(observation, *estimate);
        next.add(*estimator, *estimate);
        on_estimate(instant, *estimate);
        return true;
      },
      max_image_timeout);
}

}  // namespace tubed
