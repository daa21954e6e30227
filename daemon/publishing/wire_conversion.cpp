#include "daemon/publishing/wire_conversion.hpp"

#include <algorithm>
#include <string_view>
#include <type_traits>

#include "idl/printable_text.hpp"
#include "idl/wire_fields.h"

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
static_assert(tubed_REASON_GEOMETRY_CHANGED == static_cast<unsigned>(Reason::kGeometryChanged));
static_assert(tubed_REASON_REFERENCE_LOST == static_cast<unsigned>(Reason::kReferenceLost));
static_assert(tubed_REASON_EM_IMAGE_DISAGREE == static_cast<unsigned>(Reason::kEmImageDisagree));
static_assert(tubed_REASON_TIP_NOT_SEEN == static_cast<unsigned>(Reason::kTipNotSeen));
static_assert(tubed_REASON_AMBIGUOUS == static_cast<unsigned>(Reason::kAmbiguous));
static_assert(tubed_HELD_BY_COIL == kHeldByCoil && tubed_HELD_BY_IMAGE == kHeldByImage);

static_assert(std::size(tubed_TubeEstimate{}.points) == kMaxCentrelinePoints);
static_assert(std::size(tubed_TubeEstimate{}.coefficients_mm) == kMaxCoefficients);
static_assert(std::size(tubed_TubeEstimate{}.coils) == kMaxCoils);
static_assert(std::size(tubed_TubeEstimate{}.views) == kMaxCameras);
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
  copy_printable(text, destination);
}

template <typename T, std::size_t size>
void copy_array(const std::array<T, size>& source, T (&destination)[size]) {
  std::copy(source.begin(), source.end(), destination);
}

// What TubeEstimate.idl has besides the estimate's own fields, under its names.
struct SetByTheWriter {};
struct AddedByPublishing {
  SetByTheWriter instrument_id;
  SetByTheWriter daemon_start;
  std::int64_t valid_time_ns;
  std::int64_t valid_time_monotonic_ns;
  std::int64_t publish_time_ns;
  tubed_StageStamps stamps;
};

template <typename Ours, typename Wires>
void copy_field(const Ours& ours, Wires& wire) {
  if constexpr (std::is_enum_v<Ours>) {
    wire = static_cast<Wires>(ours);
  } else if constexpr (std::is_same_v<Ours, Reasons>) {
    wire = ours.bits();
  } else {
    static_assert(std::is_same_v<Ours, Wires>, "a field has one type, in the process and in the .idl file");
    wire = ours;
  }
}

template <typename Wires>
void copy_field(const SetByTheWriter& /*nothing*/, Wires& /*wire*/) {}

template <typename T, std::size_t size>
void copy_field(const std::array<T, size>& source, T (&destination)[size]) {
  copy_array(source, destination);
}

// Every field of `type` in the .idl file has one of its name in its struct here; a new one without that does
// not compile.
#define TUBED_COPY_FIELD(field) copy_field(ours.field, wire.field);
#define TUBED_COPY_NO_LIST(list, count) static_assert(false);
void copy_field(const CentrelinePoint& ours, tubed_CentrelinePoint& wire) {
  TUBED_FIELDS_OF_CentrelinePoint(TUBED_COPY_FIELD, TUBED_COPY_NO_LIST)
}
void copy_field(const CoilResidual& ours, tubed_CoilResidual& wire) {
  TUBED_FIELDS_OF_CoilResidual(TUBED_COPY_FIELD, TUBED_COPY_NO_LIST)
}
void copy_field(const ViewUsed& ours, tubed_ViewUsed& wire) {
  TUBED_FIELDS_OF_ViewUsed(TUBED_COPY_FIELD, TUBED_COPY_NO_LIST)
}
void copy_field(const EmImageAgreement& ours, tubed_EmImageAgreement& wire) {
  TUBED_FIELDS_OF_EmImageAgreement(TUBED_COPY_FIELD, TUBED_COPY_NO_LIST)
}
#undef TUBED_COPY_FIELD
#undef TUBED_COPY_NO_LIST

// As many elements as the count says, which is cut to the array.
template <typename T, typename Wires, std::size_t size>
void copy_list(const std::array<T, size>& ours, Wires (&wire)[size], std::uint32_t& count) {
  count = std::min<std::uint32_t>(count, size);
  for (std::size_t i = 0; i < count; ++i) {
    copy_field(ours[i], wire[i]);
  }
}

// A field of the wire that publishing adds, else that of the same name of the estimate.
template <typename Estimate, typename Added>
void copy_estimate(const Estimate& estimate, const Added& added, tubed_TubeEstimate& wire) {
#define TUBED_COPY_FIELD(field)              \
  if constexpr (requires { added.field; }) { \
    copy_field(added.field, wire.field);     \
  } else {                                   \
    copy_field(estimate.field, wire.field);  \
  }
#define TUBED_COPY_LIST(list, count) copy_list(estimate.list, wire.list, wire.count);
  TUBED_FIELDS_OF_TubeEstimate(TUBED_COPY_FIELD, TUBED_COPY_LIST)
#undef TUBED_COPY_FIELD
#undef TUBED_COPY_LIST
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
  const AddedByPublishing added{
      .instrument_id = {},
      .daemon_start = {},
      .valid_time_ns = estimate.valid_time_ns == 0 ? 0 : now.to_realtime_ns(estimate.valid_time_ns),
      .valid_time_monotonic_ns = estimate.valid_time_ns,
      .publish_time_ns = now.realtime_ns,
      .stamps = stamps_on_wire(estimate.stamps, now)};
  copy_estimate(estimate, added, wire);
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
  copy_field(health.agreement, wire.agreement);
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
