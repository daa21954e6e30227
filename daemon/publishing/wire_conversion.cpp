#include "daemon/publishing/wire_conversion.hpp"

#include <algorithm>
#include <string_view>

namespace tubed {
namespace {

static_assert(tubed_VALIDITY_NOT_AVAILABLE == static_cast<unsigned>(Validity::kNotAvailable));
static_assert(tubed_VALIDITY_VALID == static_cast<unsigned>(Validity::kValid));
static_assert(tubed_VALIDITY_QUESTIONABLE == static_cast<unsigned>(Validity::kQuestionable));
static_assert(tubed_VALIDITY_INVALID == static_cast<unsigned>(Validity::kInvalid));
static_assert(tubed_REASON_EM_STALE == static_cast<unsigned>(Reason::kEmStale));
static_assert(tubed_REASON_EM_STUCK == static_cast<unsigned>(Reason::kEmStuck));
static_assert(tubed_REASON_COIL_LOST == static_cast<unsigned>(Reason::kCoilLost));
static_assert(tubed_REASON_COIL_OUTLIER == static_cast<unsigned>(Reason::kCoilOutlier));
static_assert(tubed_REASON_OUT_OF_VOLUME == static_cast<unsigned>(Reason::kOutOfVolume));
static_assert(tubed_REASON_IMAGE_OFF == static_cast<unsigned>(Reason::kImageOff));
static_assert(tubed_REASON_IMAGE_STALE == static_cast<unsigned>(Reason::kImageStale));
static_assert(tubed_REASON_IMAGE_REJECTED == static_cast<unsigned>(Reason::kImageRejected));
static_assert(tubed_REASON_IMAGE_LOST_TUBE == static_cast<unsigned>(Reason::kImageLostTube));
static_assert(tubed_REASON_NOT_CONVERGED == static_cast<unsigned>(Reason::kNotConverged));
static_assert(tubed_REASON_NO_REGISTRATION == static_cast<unsigned>(Reason::kNoRegistration));
static_assert(tubed_REASON_CLOCK_UNSYNCED == static_cast<unsigned>(Reason::kClockUnsynced));
static_assert(tubed_REASON_DEADLINE_MISSED == static_cast<unsigned>(Reason::kDeadlineMissed));
static_assert(tubed_REASON_INITIALISING == static_cast<unsigned>(Reason::kInitialising));
static_assert(tubed_REASON_DEMO_DATA == static_cast<unsigned>(Reason::kDemoData));
static_assert(tubed_REASON_REPLAY_DATA == static_cast<unsigned>(Reason::kReplayData));
static_assert(tubed_REASON_RIVAL_WRITER == static_cast<unsigned>(Reason::kRivalWriter));

static_assert(std::size(tubed_TubeEstimate{}.points) == kMaxCentrelinePoints);
static_assert(std::size(tubed_TubeEstimate{}.coefficients_mm) == kMaxCoefficients);
static_assert(std::size(tubed_TubeEstimate{}.coils) == kMaxCoils);
static_assert(std::size(tubed_EmSamples{}.coils) == kMaxCoils);
static_assert(std::size(tubed_TubeIdentity{}.coil_offsets_from_tip_mm) == kMaxCoils);
static_assert(std::size(tubed_TubeIdentity{}.cameras) == kMaxCameras);
static_assert(std::size(tubed_TubeIdentity{}.tracker.tools) == kMaxTools);
static_assert(std::size(tubed_TubeStatus{}.stages) == kMaxStages);
static_assert(sizeof(tubed_TubeStatus{}.stages[0].why) == sizeof(StageReport{}.why));
static_assert(std::size(tubed_TubeHealth{}.stages) == kMaxStages);
static_assert(std::size(tubed_LatencyHistogram{}.buckets) == kLatencyBuckets);
static_assert(sizeof(tubed_TubeEstimate{}.instrument_id) == kInstrumentIdLength + 1);

template <std::size_t size>
void copy_text(std::string_view text, char (&destination)[size]) {
  const std::size_t length = std::min(text.size(), size - 1);
  std::copy_n(text.data(), length, destination);
  std::fill_n(destination + length, size - length, '\0');
}

template <typename T, std::size_t size>
void copy_array(const std::array<T, size>& source, T (&destination)[size]) {
  std::copy(source.begin(), source.end(), destination);
}

void copy_points(const TubeEstimate& estimate, tubed_TubeEstimate& wire) {
  wire.point_count = std::min<std::uint32_t>(estimate.point_count, kMaxCentrelinePoints);
  for (std::size_t i = 0; i < wire.point_count; ++i) {
    copy_array(estimate.points[i].p_world_mm, wire.points[i].p_world_mm);
    copy_array(estimate.points[i].tangent_world, wire.points[i].tangent_world);
    copy_array(estimate.points[i].covariance_mm2, wire.points[i].covariance_mm2);
  }
}

void copy_coefficients(const TubeEstimate& estimate, tubed_TubeEstimate& wire) {
  wire.coefficient_count = std::min<std::uint32_t>(estimate.coefficient_count, kMaxCoefficients);
  wire.coefficient_spacing_mm = estimate.coefficient_spacing_mm;
  for (std::size_t i = 0; i < wire.coefficient_count; ++i) {
    copy_array(estimate.coefficients_mm[i], wire.coefficients_mm[i]);
  }
}

void copy_coils(const TubeEstimate& estimate, tubed_TubeEstimate& wire) {
  wire.coil_count = std::min<std::uint32_t>(estimate.coil_count, kMaxCoils);
  for (std::size_t i = 0; i < wire.coil_count; ++i) {
    const CoilResidual& coil = estimate.coils[i];
    wire.coils[i] = {.state = static_cast<std::uint32_t>(coil.state),
                     .offset_from_tip_mm = coil.offset_from_tip_mm,
                     .position_mm = coil.position_mm,
                     .angle_rad = coil.angle_rad};
  }
}

tubed_StageStamps stamps_on_wire(const StageStamps& stamps, const ClockPair& now) {
  return {.exposure_monotonic_ns = stamps.exposure_ns,
          .image_grabbed_monotonic_ns = stamps.image_grabbed_ns,
          .frangi_started_monotonic_ns = stamps.frangi_started_ns,
          .frangi_finished_monotonic_ns = stamps.frangi_finished_ns,
          .em_measured_monotonic_ns = stamps.em_measured_ns,
          .em_received_monotonic_ns = stamps.em_received_ns,
          .optimizer_started_monotonic_ns = stamps.optimizer_started_ns,
          .optimizer_finished_monotonic_ns = stamps.optimizer_finished_ns,
          .publish_started_monotonic_ns = now.monotonic_ns};
}

void copy_histogram(const LatencyHistogramValues& histogram, tubed_LatencyHistogram& wire) {
  wire.count = histogram.count;
  wire.max_ns = histogram.max_ns;
  copy_array(histogram.buckets, wire.buckets);
}

void copy_camera(const CameraIdentityValues& camera, tubed_CameraIdentity& wire) {
  copy_text(camera.name, wire.name);
  wire.width = camera.width_px;
  wire.height = camera.height_px;
  copy_array(camera.focal_length_px, wire.focal_length_px);
  copy_array(camera.principal_point_px, wire.principal_point_px);
  copy_array(camera.distortion, wire.distortion);
  copy_array(camera.T_camera_world, wire.T_camera_world);
}

void copy_tracker(const TrackerIdentityValues& tracker, tubed_TrackerIdentity& wire) {
  copy_text(tracker.firmware, wire.firmware);
  copy_text(tracker.api_revision, wire.api_revision);
  copy_text(tracker.control_unit_serial, wire.control_unit_serial);
  copy_text(tracker.field_generator, wire.field_generator);
  wire.tool_count = static_cast<std::uint32_t>(std::min<std::size_t>(tracker.tools.size(), kMaxTools));
  for (std::size_t i = 0; i < wire.tool_count; ++i) {
    wire.tools[i].port = tracker.tools[i].port;
    wire.tools[i].serial_number = tracker.tools[i].serial_number;
    copy_text(tracker.tools[i].part_number, wire.tools[i].part_number);
  }
}

}  // namespace

void to_wire(const TubeEstimate& estimate, const ClockPair& now, tubed_TubeEstimate& wire) {
  wire.sequence_number = estimate.sequence_number;
  wire.valid_time_ns = estimate.valid_time_ns == 0 ? 0 : now.to_realtime_ns(estimate.valid_time_ns);
  wire.valid_time_monotonic_ns = estimate.valid_time_ns;
  wire.publish_time_ns = now.realtime_ns;
  wire.validity = static_cast<std::uint32_t>(estimate.validity);
  wire.reasons = estimate.reasons.bits();
  wire.has_image = estimate.has_image;
  wire.is_image_instant = estimate.is_image_instant;
  wire.image_frame = estimate.image_frame;
  wire.em_frame = estimate.em_frame;
  wire.em_age_ns = estimate.em_age_ns;
  wire.image_age_ns = estimate.image_age_ns;
  wire.radius_mm = estimate.radius_mm;
  wire.length_mm = estimate.length_mm;
  wire.image_inlier_ratio = estimate.image_inlier_ratio;
  wire.in_view_ratio = estimate.in_view_ratio;
  wire.iterations = estimate.iterations;
  copy_points(estimate, wire);
  copy_coefficients(estimate, wire);
  copy_coils(estimate, wire);
  wire.stamps = stamps_on_wire(estimate.stamps, now);
}

void to_wire(const EmSamplesValues& samples, const ClockPair& now, tubed_EmSamples& wire) {
  wire.sequence_number = samples.sequence_number;
  wire.measured_ns = now.to_realtime_ns(samples.measured_ns);
  wire.measured_monotonic_ns = samples.measured_ns;
  wire.received_monotonic_ns = samples.received_ns;
  wire.tracker_frame = samples.tracker_frame;
  wire.origin = samples.origin;
  wire.coil_count = std::min<std::uint32_t>(samples.coil_count, kMaxCoils);
  for (std::size_t i = 0; i < wire.coil_count; ++i) {
    wire.coils[i].status = samples.coils[i].status;
    copy_array(samples.coils[i].p_em_mm, wire.coils[i].p_em_mm);
    copy_array(samples.coils[i].tangent_em, wire.coils[i].tangent_em);
    wire.coils[i].indicator = samples.coils[i].indicator;
  }
}

void to_wire(const InstrumentStatus& status, std::span<const NamedStageReport> stages, const ClockPair& now,
             tubed_TubeStatus& wire) {
  wire.time_ns = now.realtime_ns;
  wire.validity = static_cast<std::uint32_t>(status.validity);
  wire.reasons = status.reasons.bits();
  wire.estimate_age_ns = status.estimate_age_ns;
  wire.stage_count = static_cast<std::uint32_t>(std::min<std::size_t>(stages.size(), kMaxStages));
  for (std::size_t i = 0; i < wire.stage_count; ++i) {
    const StageReport& report = stages[i].report;
    copy_text(stages[i].name, wire.stages[i].name);
    wire.stages[i].state = static_cast<std::uint32_t>(report.state);
    wire.stages[i].since_ns = now.to_realtime_ns(report.since_ns);
    wire.stages[i].age_ns = report.reported_ns == 0 ? -1 : now.monotonic_ns - report.reported_ns;
    const auto end = std::find(report.why.begin(), report.why.end(), '\0');
    copy_text(std::string_view(report.why.data(), static_cast<std::size_t>(end - report.why.begin())),
              wire.stages[i].why);
  }
}

void to_wire(const InstrumentHealthValues& health, std::span<const NamedStageReport> stages,
             const ClockPair& now, tubed_TubeHealth& wire) {
  wire.time_ns = now.realtime_ns;
  wire.estimates = health.estimates;
  copy_array(health.validity_counts, wire.validity_counts);
  copy_histogram(health.exposure_to_publish, wire.exposure_to_publish);
  wire.stage_count = static_cast<std::uint32_t>(std::min<std::size_t>(stages.size(), kMaxStages));
  for (std::size_t i = 0; i < wire.stage_count; ++i) {
    const StageReport& report = stages[i].report;
    tubed_StageHealth& stage = wire.stages[i];
    copy_text(stages[i].name, stage.name);
    stage.steps = report.steps;
    stage.outputs = report.outputs;
    stage.dropped = report.dropped;
    stage.refused = report.refused;
    stage.reconnects = report.reconnects;
    stage.allocations = report.allocations;
    stage.locks = report.locks;
    stage.exceptions = report.exceptions;
    stage.allocations_counted = health.allocations_counted[i];
    copy_histogram(report.busy, stage.busy);
  }
}

void to_wire(const TubeIdentityValues& identity, tubed_TubeIdentity& wire) {
  copy_text(identity.instrument_id, wire.instrument_id);
  copy_text(identity.software_version, wire.software_version);
  copy_text(identity.configuration_digest, wire.configuration_digest);
  copy_text(identity.mode, wire.mode);
  wire.diameter_mm = identity.diameter_mm;
  wire.length_mm = identity.length_mm;
  wire.coil_count =
      static_cast<std::uint32_t>(std::min<std::size_t>(identity.coil_offsets_from_tip_mm.size(), kMaxCoils));
  std::copy_n(identity.coil_offsets_from_tip_mm.begin(), wire.coil_count, wire.coil_offsets_from_tip_mm);
  copy_array(identity.T_world_em, wire.T_world_em);
  wire.registration_residual_mm = identity.registration_residual_mm;
  copy_text(identity.world_frame, wire.world_frame);
  copy_text(identity.world_axes, wire.world_axes);
  wire.camera_count = static_cast<std::uint32_t>(std::min<std::size_t>(identity.cameras.size(), kMaxCameras));
  for (std::size_t i = 0; i < wire.camera_count; ++i) {
    copy_camera(identity.cameras[i], wire.cameras[i]);
  }
  copy_tracker(identity.tracker, wire.tracker);
}

}  // namespace tubed
