#include <algorithm>
#include <span>

#include "clients/tubectl/sample_text.hpp"
#include "idl/validity.hpp"

namespace tubed {
namespace {

using nlohmann::json;

/// The elements of a wire array that its count says are there.
template <typename T, std::size_t size>
std::span<const T> used(const T (&array)[size], std::uint32_t count) {
  return {array, std::min<std::size_t>(count, size)};
}

template <typename T>
json objects(std::span<const T> elements, json (*convert)(const T&)) {
  json list = json::array();
  for (const T& element : elements) list.push_back(convert(element));
  return list;
}

json point_json(const tubed_CentrelinePoint& point) {
  return {{"p_world_mm", point.p_world_mm},
          {"tangent_world", point.tangent_world},
          {"covariance_mm2", point.covariance_mm2}};
}

json residual_json(const tubed_CoilResidual& coil) {
  return {{"state", coil.state},
          {"offset_from_tip_mm", coil.offset_from_tip_mm},
          {"position_mm", coil.position_mm},
          {"angle_rad", coil.angle_rad}};
}

json stamps_json(const tubed_StageStamps& stamps) {
  return {{"exposure_monotonic_ns", stamps.exposure_monotonic_ns},
          {"image_grabbed_monotonic_ns", stamps.image_grabbed_monotonic_ns},
          {"frangi_started_monotonic_ns", stamps.frangi_started_monotonic_ns},
          {"frangi_finished_monotonic_ns", stamps.frangi_finished_monotonic_ns},
          {"em_measured_monotonic_ns", stamps.em_measured_monotonic_ns},
          {"em_received_monotonic_ns", stamps.em_received_monotonic_ns},
          {"optimizer_started_monotonic_ns", stamps.optimizer_started_monotonic_ns},
          {"optimizer_finished_monotonic_ns", stamps.optimizer_finished_monotonic_ns},
          {"publish_started_monotonic_ns", stamps.publish_started_monotonic_ns}};
}

json coil_json(const tubed_EmCoil& coil) {
  return {{"status", coil.status},
          {"p_em_mm", coil.p_em_mm},
          {"tangent_em", coil.tangent_em},
          {"indicator", coil.indicator}};
}

json stage_status_json(const tubed_StageStatus& stage) {
  return {{"name", stage.name},
          {"state", stage.state},
          {"since_ns", stage.since_ns},
          {"age_ns", stage.age_ns},
          {"why", stage.why}};
}

json histogram_json(const tubed_LatencyHistogram& histogram) {
  return {{"count", histogram.count}, {"max_ns", histogram.max_ns}, {"buckets", histogram.buckets}};
}

json stage_health_json(const tubed_StageHealth& stage) {
  return {{"name", stage.name},
          {"steps", stage.steps},
          {"outputs", stage.outputs},
          {"dropped", stage.dropped},
          {"refused", stage.refused},
          {"reconnects", stage.reconnects},
          {"allocations", stage.allocations},
          {"locks", stage.locks},
          {"exceptions", stage.exceptions},
          {"allocations_counted", stage.allocations_counted},
          {"busy", histogram_json(stage.busy)}};
}

json camera_json(const tubed_CameraIdentity& camera) {
  return {{"name", camera.name},
          {"width", camera.width},
          {"height", camera.height},
          {"focal_length_px", camera.focal_length_px},
          {"principal_point_px", camera.principal_point_px},
          {"distortion", camera.distortion},
          {"T_camera_world", camera.T_camera_world}};
}

json tool_json(const tubed_ToolIdentity& tool) {
  return {{"port", tool.port}, {"serial_number", tool.serial_number}, {"part_number", tool.part_number}};
}

json tracker_json(const tubed_TrackerIdentity& tracker) {
  return {{"firmware", tracker.firmware},
          {"api_revision", tracker.api_revision},
          {"control_unit_serial", tracker.control_unit_serial},
          {"field_generator", tracker.field_generator},
          {"tool_count", tracker.tool_count},
          {"tools", objects(used(tracker.tools, tracker.tool_count), tool_json)}};
}

}  // namespace

json to_json(const tubed_TubeEstimate& estimate) {
  return {{"instrument_id", estimate.instrument_id},
          {"sequence_number", estimate.sequence_number},
          {"daemon_start", estimate.daemon_start},
          {"valid_time_ns", estimate.valid_time_ns},
          {"valid_time_monotonic_ns", estimate.valid_time_monotonic_ns},
          {"publish_time_ns", estimate.publish_time_ns},
          {"validity", estimate.validity},
          {"validity_name", name_of(static_cast<Validity>(estimate.validity))},
          {"reasons", estimate.reasons},
          {"reason_names", names_of(Reasons(estimate.reasons))},
          {"has_image", estimate.has_image},
          {"is_image_instant", estimate.is_image_instant},
          {"image_frame", estimate.image_frame},
          {"em_frame", estimate.em_frame},
          {"em_age_ns", estimate.em_age_ns},
          {"image_age_ns", estimate.image_age_ns},
          {"radius_mm", estimate.radius_mm},
          {"length_mm", estimate.length_mm},
          {"image_inlier_ratio", estimate.image_inlier_ratio},
          {"in_view_ratio", estimate.in_view_ratio},
          {"iterations", estimate.iterations},
          {"point_count", estimate.point_count},
          {"points", objects(used(estimate.points, estimate.point_count), point_json)},
          {"coefficient_count", estimate.coefficient_count},
          {"coefficient_spacing_mm", estimate.coefficient_spacing_mm},
          {"coefficients_mm",
           objects<double[3]>(used(estimate.coefficients_mm, estimate.coefficient_count),
                              [](const double(&coefficient)[3]) { return json(coefficient); })},
          {"coil_count", estimate.coil_count},
          {"coils", objects(used(estimate.coils, estimate.coil_count), residual_json)},
          {"stamps", stamps_json(estimate.stamps)}};
}

json to_json(const tubed_EmSamples& samples) {
  return {{"instrument_id", samples.instrument_id},
          {"sequence_number", samples.sequence_number},
          {"daemon_start", samples.daemon_start},
          {"measured_ns", samples.measured_ns},
          {"measured_monotonic_ns", samples.measured_monotonic_ns},
          {"received_monotonic_ns", samples.received_monotonic_ns},
          {"tracker_frame", samples.tracker_frame},
          {"origin", samples.origin},
          {"coil_count", samples.coil_count},
          {"coils", objects(used(samples.coils, samples.coil_count), coil_json)}};
}

json to_json(const tubed_TubeStatus& status) {
  return {{"instrument_id", status.instrument_id},
          {"daemon_start", status.daemon_start},
          {"time_ns", status.time_ns},
          {"validity", status.validity},
          {"validity_name", name_of(static_cast<Validity>(status.validity))},
          {"reasons", status.reasons},
          {"reason_names", names_of(Reasons(status.reasons))},
          {"estimate_age_ns", status.estimate_age_ns},
          {"stage_count", status.stage_count},
          {"stages", objects(used(status.stages, status.stage_count), stage_status_json)}};
}

json to_json(const tubed_TubeIdentity& identity) {
  return {{"instrument_id", identity.instrument_id},
          {"daemon_start", identity.daemon_start},
          {"software_version", identity.software_version},
          {"configuration_digest", identity.configuration_digest},
          {"mode", identity.mode},
          {"diameter_mm", identity.diameter_mm},
          {"length_mm", identity.length_mm},
          {"coil_count", identity.coil_count},
          {"coil_offsets_from_tip_mm", used(identity.coil_offsets_from_tip_mm, identity.coil_count)},
          {"T_world_em", identity.T_world_em},
          {"registration_residual_mm", identity.registration_residual_mm},
          {"world_frame", identity.world_frame},
          {"world_axes", identity.world_axes},
          {"camera_count", identity.camera_count},
          {"cameras", objects(used(identity.cameras, identity.camera_count), camera_json)},
          {"tracker", tracker_json(identity.tracker)}};
}

json to_json(const tubed_TubeHealth& health) {
  return {{"instrument_id", health.instrument_id},
          {"daemon_start", health.daemon_start},
          {"time_ns", health.time_ns},
          {"estimates", health.estimates},
          {"validity_counts", health.validity_counts},
          {"exposure_to_publish", histogram_json(health.exposure_to_publish)},
          {"stage_count", health.stage_count},
          {"stages", objects(used(health.stages, health.stage_count), stage_health_json)}};
}

}  // namespace tubed
