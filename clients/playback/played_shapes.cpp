#include "clients/playback/played_shapes.hpp"

#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <system_error>
#include <type_traits>

#include "clients/evaluation/true_run.hpp"
#include "daemon/config/published_room.hpp"
#include "daemon/estimator/coils/em_history.hpp"
#include "daemon/publishing/wire_conversion.hpp"

namespace tubed {

static_assert(std::is_trivially_copyable_v<PlayedInstant>, "it lies in a file as it lies in memory");

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// Image instants of a sequence have no real time.
ClockPair clocks_at(const Observation& observation) {
  return {to_ns(observation.instant), to_ns(observation.instant)};
}

float largest_residual(const TubeEstimate& estimate) {
  float largest = kNone;
  for (std::uint32_t i = 0; i < estimate.coil_count; ++i) {
    const CoilResidual& coil = estimate.coils[i];
    if (coil.state == CoilState::kUsed && !(largest >= coil.position_mm)) largest = coil.position_mm;
  }
  return largest;
}

float largest_sigma(const TubeEstimate& estimate) {
  double largest_mm2 = -1;
  for (std::uint32_t i = 0; i < estimate.point_count; ++i) {
    const auto& c = estimate.points[i].covariance_mm2;
    Eigen::Matrix3d covariance;
    covariance << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    if (!covariance.allFinite()) return kNone;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
    largest_mm2 = std::max(largest_mm2, solver.eigenvalues()[2]);
  }
  return largest_mm2 < 0 ? kNone : static_cast<float>(std::sqrt(largest_mm2));
}

SampledCentreline centreline_of(const TubeEstimate& estimate) {
  SampledCentreline curve;
  const auto count = static_cast<Eigen::Index>(estimate.point_count);
  curve.p_world_mm.resize(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    curve.s_mm.push_back(static_cast<double>(estimate.length_mm) * static_cast<double>(i) /
                         static_cast<double>(std::max<Eigen::Index>(count - 1, 1)));
    curve.p_world_mm.col(i) =
        Eigen::Vector3d::Map(estimate.points[static_cast<std::size_t>(i)].p_world_mm.data());
  }
  return curve;
}

/// RMS distance in view, where the truth is known.
float error_of(const TubeEstimate& estimate, const TrueRun& run, std::size_t instant) {
  const TrueInstant& truth = run.instants[instant];
  if (estimate.point_count == 0 || truth.truth.s_mm.size() < 2) return kNone;
  Camera view = run.cameras[truth.view_camera];
  view.look_from(truth.view);
  ShapeErrorSettings settings;
  settings.part = JudgedPart::kInView;
  const auto error = shape_error(centreline_of(estimate), truth.truth, {run.cameras.front(), view}, settings);
  return error ? static_cast<float>(error->rms_mm) : kNone;
}

/// The newest measurement as subscribers have it.
void fill_newest_coils(const InstrumentDescription& instrument, const Observation& observation,
                       PlayedInstant& into) {
  into.coils.coil_count = 0;
  const EmFrame* const frame = observation.em->newest_until(observation.instant);
  if (frame == nullptr) return;
  EmSamplesValues values;
  fill_coils(instrument, *frame, observation.em->placement(frame), values);
  to_wire(values, clocks_at(observation), into.coils);
}

void name_instrument(const std::string& id, char (&to)[kInstrumentIdLength + 1]) {
  std::snprintf(to, sizeof to, "%s", id.c_str());
}

}  // namespace

PlayedShapes::PlayedShapes(const ConfiguredSequence& run)
    : run_(run),
      instants_(instants_of(run.sequence)),
      truth_(true_run_of(run.sequence)),
      file_(std::tmpfile()) {
  if (!file_) {
    throw std::system_error(errno, std::generic_category(),
                            "no temporary file for the shapes (TMPDIR, /tmp)");
  }
  thread_ = std::thread([this] { make(); });
}

PlayedShapes::~PlayedShapes() {
  must_end_ = true;
  thread_.join();
}

void PlayedShapes::make() {
  try {
    make_all();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    trouble_ = error.what();
  }
}

void PlayedShapes::make_all() {
  const Sequence& sequence = run_.sequence;
  const InstrumentDescription& instrument = sequence.room.instruments.front();
  EstimatorSettings em_settings = run_.estimator;
  em_settings.mode = EstimatorMode::kEm;
  const bool only_em = run_.estimator.mode == EstimatorMode::kEm;
  const auto fused = make_estimator(run_.estimator, instrument, sequence.room);
  const auto coils_only = make_estimator(em_settings, instrument, sequence.room);
  const auto estimate = std::make_unique<TubeEstimate>();
  const auto coils_only_estimate = std::make_unique<TubeEstimate>();
  const auto made = std::make_unique<PlayedInstant>();
  name_instrument(instrument.id, made->fused.instrument_id);
  name_instrument(instrument.id + "-em", made->coils_only.instrument_id);
  std::size_t i = 0;
  observe_in_turn(
      sequence, only_em ? Images::kLeftOut : Images::kMeasured, run_.frangi,
      [&](const SequenceInstant&, const Observation& observation, AreaPredictions& next) {
        const ClockPair clocks = clocks_at(observation);
        estimate->sequence_number = coils_only_estimate->sequence_number = i + 1;
        if (!only_em) {
          coils_only->estimate(observation, *coils_only_estimate);
          to_wire(*coils_only_estimate, clocks, made->coils_only);
        }
        fused->estimate(observation, *estimate);
        next.add(*fused, *estimate);
        to_wire(*estimate, clocks, made->fused);
        fill_newest_coils(instrument, observation, *made);
        keep(i, *made);
        const InstantSummary summary{estimate->validity, largest_residual(*estimate),
                                     largest_sigma(*estimate), error_of(*estimate, truth_, i)};
        const std::lock_guard lock(mutex_);
        summaries_.push_back(summary);
        ready_ = ++i;
        return !must_end_;
      },
      run_.max_image_timeout);
}

void PlayedShapes::keep(std::size_t instant, const PlayedInstant& made) {
  const auto offset = static_cast<off_t>(instant * sizeof made);
  const ssize_t written = pwrite(fileno(file_.get()), &made, sizeof made, offset);
  if (written != static_cast<ssize_t>(sizeof made)) {
    throw std::system_error(written < 0 ? errno : ENOSPC, std::generic_category(),
                            "the shapes cannot be kept in the folder for temporary files (TMPDIR, /tmp)");
  }
}

void PlayedShapes::read(std::size_t instant, PlayedInstant& into) const {
  const auto offset = static_cast<off_t>(instant * sizeof into);
  if (pread(fileno(file_.get()), &into, sizeof into, offset) != static_cast<ssize_t>(sizeof into)) {
    throw std::system_error(errno, std::generic_category(), "the shapes cannot be read back");
  }
}

void PlayedShapes::add_summaries(std::vector<InstantSummary>& summaries) const {
  const std::lock_guard lock(mutex_);
  summaries.insert(summaries.end(), summaries_.begin() + static_cast<std::ptrdiff_t>(summaries.size()),
                   summaries_.end());
}

std::string PlayedShapes::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

}  // namespace tubed
